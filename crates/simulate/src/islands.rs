//! Islands: bodies that contacts and joints join, by union–find; bodies that do not move freely join nothing.

/// Union–find with the least member as the name of each set, and the contacts of each set.
#[derive(Debug, Clone, Default)]
pub(crate) struct Islands {
    parent: Vec<u32>,
    /// Contacts and rows, those of one island together, in their order.
    pub order: Vec<u32>,
    /// Where each island ends in `order`.
    pub ends: Vec<usize>,
    /// Of each body the island, [`NONE`] where nothing acts on it.
    pub of_body: Vec<u32>,
    /// Of each contact and row one of its bodies, then its island.
    pub of_item: Vec<u32>,
}

/// No island.
pub(crate) const NONE: u32 = u32::MAX;

impl Islands {
    /// Of `bodies` bodies; `each` calls with the free bodies, at least one, of every contact and then of every scalar row. Islands are in the order of their
    /// least bodies.
    pub fn find(
        &mut self,
        bodies: usize,
        each: impl FnOnce(&mut dyn FnMut(&mut dyn Iterator<Item = u32>)),
    ) {
        self.parent.clear();
        self.parent.extend(0..bodies as u32);
        self.of_item.clear();
        let mut numbers = std::mem::take(&mut self.of_item);
        each(&mut |members| {
            let one = members.next().expect("one of the bodies is free");
            let mut root = self.root(one);
            for other in members {
                let other = self.root(other);
                let (low, high) = (root.min(other), root.max(other));
                self.parent[high as usize] = low;
                root = low;
            }
            numbers.push(root);
        });
        // How many contacts and rows the set of each root has, and then its number among those that have one.
        self.of_body.clear();
        self.of_body.resize(bodies, 0);
        for number in &mut numbers {
            *number = self.root(*number);
            self.of_body[*number as usize] += 1;
        }
        self.ends.clear();
        let mut end = 0;
        for k in 0..bodies as u32 {
            let root = self.root(k) as usize;
            // A root is the least member of its set, so it has its number before the others ask for it.
            if root != k as usize || self.of_body[root] == 0 {
                self.of_body[k as usize] =
                    if root == k as usize { NONE } else { self.of_body[root] };
                continue;
            }
            let count = std::mem::replace(&mut self.of_body[root], self.ends.len() as u32);
            self.ends.push(end);
            end += count as usize;
        }
        self.order.clear();
        self.order.resize(numbers.len(), 0);
        for (c, number) in numbers.iter_mut().enumerate() {
            *number = self.of_body[*number as usize];
            let place = &mut self.ends[*number as usize];
            self.order[*place] = c as u32;
            *place += 1;
        }
        self.of_item = numbers;
    }

    /// All contacts and rows as if they were one island.
    pub fn unite(&mut self) {
        let count = self.order.len();
        self.order.clear();
        self.order.extend(0..count as u32);
        self.ends.clear();
        self.ends.extend((count > 0).then_some(count));
        self.of_item.fill(0);
        self.of_body.iter_mut().filter(|k| **k != NONE).for_each(|k| *k = 0);
    }

    /// Where the contacts and rows of island k are in the order.
    pub fn range(&self, k: usize) -> std::ops::Range<usize> {
        let first = if k == 0 { 0 } else { self.ends[k - 1] };
        first..self.ends[k]
    }

    fn root(&mut self, mut k: u32) -> u32 {
        while self.parent[k as usize] != k {
            let above = self.parent[self.parent[k as usize] as usize];
            self.parent[k as usize] = above;
            k = above;
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_fall_into_islands_in_the_order_of_their_bodies() {
        let pairs = [
            [Some(5), Some(6)],
            [None, Some(2)],
            [Some(0), Some(3)],
            [Some(6), None],
            [Some(3), Some(7)],
            [Some(1), Some(7)],
        ];
        let mut islands = Islands::default();
        islands.find(8, |join| pairs.into_iter().for_each(|p| join(&mut p.into_iter().flatten())));
        assert_eq!(islands.order, [2, 4, 5, 1, 0, 3]);
        assert_eq!(islands.ends, [3, 4, 6]);
        assert_eq!(islands.of_item, [2, 1, 0, 2, 0, 0]);
        assert_eq!(islands.of_body, [0, 0, 1, 0, NONE, 2, 2, 0]);
        islands.unite();
        assert_eq!((&islands.order[..], &islands.ends[..]), (&[0, 1, 2, 3, 4, 5][..], &[6][..]));
        assert_eq!(islands.of_body, [0, 0, 0, 0, NONE, 0, 0, 0]);
    }
}
