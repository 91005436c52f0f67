//! Which contacts act on which bodies: contacts by their places, those of an island one after the other.

use std::ops::Range;

use super::NONE;
use super::couple::Shared;
use crate::islands::Islands;

/// The contacts of a step by places.
#[derive(Default)]
pub(super) struct Touching {
    /// The row of the contact at each place, and the place of each row.
    pub order: Vec<u32>,
    pub place_of: Vec<u32>,
    /// Where each island begins, and the last one ends.
    pub firsts: Vec<usize>,
    /// The free bodies and elastic solids of each contact, by place.
    pairs: Vec<[u32; 2]>,
    /// Of each body and solid that an island has its number there, and how many each island has.
    numbers: Vec<u32>,
    counts: Vec<u32>,
    /// Where in the list those of each body and solid end; twice the place of each of its contacts, and its side there.
    ends: Vec<u32>,
    list: Vec<u32>,
}

impl Touching {
    /// Of so many bodies and solids; `pairs` are those of the contacts, which come before scalar rows in each island.
    pub fn arrange(&mut self, owners: usize, pairs: &[[u32; 2]], islands: &Islands) {
        let contacts = pairs.len();
        self.order.clear();
        self.firsts.clear();
        for k in 0..islands.ends.len() {
            self.firsts.push(self.order.len());
            let items = islands.order[islands.range(k)].iter();
            self.order.extend(items.take_while(|&&item| (item as usize) < contacts));
        }
        self.firsts.push(self.order.len());
        self.counts.clear();
        self.counts.resize(islands.ends.len(), 0);
        self.numbers.resize(owners, NONE);
        for (number, &k) in self.numbers.iter_mut().zip(&islands.of_body).filter(|o| *o.1 != NONE) {
            let count = &mut self.counts[k as usize];
            *number = *count;
            *count += 1;
        }
        self.place_of.resize(contacts, 0);
        self.pairs.clear();
        self.ends.clear();
        self.ends.resize(owners, 0);
        for (place, &c) in self.order.iter().enumerate() {
            let pair = pairs[c as usize];
            self.place_of[c as usize] = place as u32;
            self.pairs.push(pair);
            pair.iter().filter(|b| **b != NONE).for_each(|&b| self.ends[b as usize] += 1);
        }
        let mut sum = 0;
        for end in &mut self.ends {
            sum += std::mem::replace(end, sum);
        }
        self.list.resize(sum as usize, 0);
        for (place, pair) in self.pairs.iter().enumerate() {
            for (side, &body) in pair.iter().enumerate().filter(|b| *b.1 != NONE) {
                let end = &mut self.ends[body as usize];
                self.list[*end as usize] = (2 * place + side) as u32;
                *end += 1;
            }
        }
    }

    /// The places of island k.
    pub fn island(&self, k: usize) -> Range<usize> {
        self.firsts[k]..self.firsts[k + 1]
    }

    /// How many bodies and solids island k has.
    pub fn members(&self, k: usize) -> usize {
        self.counts[k] as usize
    }

    /// The bodies and solids of the contact at a place, by their numbers in its island.
    pub fn members_at(&self, place: usize) -> [Option<usize>; 2] {
        self.pairs[place].map(|b| (b != NONE).then(|| self.numbers[b as usize] as usize))
    }

    fn listed(&self, owner: u32) -> &[u32] {
        let first = if owner == 0 { 0 } else { self.ends[owner as usize - 1] };
        &self.list[first as usize..self.ends[owner as usize] as usize]
    }

    /// The places of the contacts of a body or solid, ascending, with its side of each.
    pub fn of(&self, owner: u32) -> impl Iterator<Item = (usize, usize)> {
        self.listed(owner).iter().map(|&entry| (entry as usize / 2, entry as usize % 2))
    }

    /// The contacts of the two bodies of a contact, merged, each with the sides on which it touches the one and the other; a body that is not free has none.
    pub fn neighbours(&self, place: usize) -> impl Iterator<Item = (usize, Shared)> {
        let [mut one, mut other] =
            self.pairs[place].map(|b| if b == NONE { &[][..] } else { self.listed(b) }.iter());
        let (mut first, mut second) = (one.next(), other.next());
        std::iter::from_fn(move || {
            let at = |entry: Option<&u32>| entry.map_or(NONE, |entry| entry / 2);
            let j = at(first).min(at(second));
            if j == NONE {
                return None;
            }
            let mut shared = [NONE; 2];
            if at(first) == j {
                shared[0] = first.map_or(NONE, |entry| entry % 2);
                first = one.next();
            }
            if at(second) == j {
                shared[1] = second.map_or(NONE, |entry| entry % 2);
                second = other.next();
            }
            Some((j as usize, shared))
        })
    }
}
