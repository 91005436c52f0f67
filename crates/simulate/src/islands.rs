//! Islands: bodies that contacts and joints join, by union–find; bodies that do not move freely join nothing.

/// Union–find with the least member as the name of each set, and the contacts of each set.
#[derive(Debug, Clone, Default)]
pub(crate) struct Islands {
    parent: Vec<u32>,
    /// Contacts and rows, those of one island together, in their order.
    pub order: Vec<u32>,
    /// Where each island ends in `order`.
    pub ends: Vec<usize>,
    number: Vec<u32>,
    keyed: Vec<(u32, u32)>,
}

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
        self.number.clear();
        let mut number = std::mem::take(&mut self.number);
        each(&mut |members| {
            let one = members.next().expect("one of the bodies is free");
            let mut root = self.root(one);
            for other in members {
                let other = self.root(other);
                let (low, high) = (root.min(other), root.max(other));
                self.parent[high as usize] = low;
                root = low;
            }
            number.push(root);
        });
        self.number = number;
        self.keyed.clear();
        for c in 0..self.number.len() {
            let root = self.root(self.number[c]);
            self.keyed.push((root, c as u32));
        }
        self.keyed.sort_unstable();
        self.order.clear();
        self.order.extend(self.keyed.iter().map(|k| k.1));
        self.ends.clear();
        let n = self.keyed.len();
        let last = |k: &usize| *k == n || self.keyed[*k].0 != self.keyed[*k - 1].0;
        self.ends.extend((1..=n).filter(last));
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
    }
}
