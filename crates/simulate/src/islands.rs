//! Islands: bodies that contacts join, by union–find; bodies that do not move freely join nothing.

/// Union–find with the least member as the name of each set, and the contacts of each set.
#[derive(Debug, Clone, Default)]
pub(crate) struct Islands {
    parent: Vec<u32>,
    /// Contacts, those of one island together, in their order.
    pub order: Vec<u32>,
    /// Where each island ends in `order`.
    pub ends: Vec<usize>,
    number: Vec<u32>,
    keyed: Vec<(u32, u32)>,
}

impl Islands {
    /// Of contacts between `bodies` bodies, each with the free bodies that it touches; islands are in the order of their least bodies.
    pub fn find(&mut self, bodies: usize, contacts: impl Iterator<Item = [Option<u32>; 2]>) {
        self.parent.clear();
        self.parent.extend(0..bodies as u32);
        self.number.clear();
        for [a, b] in contacts {
            let one = a.or(b).expect("one of two bodies is free");
            let mut root = self.root(one);
            if let Some(other) = b {
                let other = self.root(other);
                let (low, high) = (root.min(other), root.max(other));
                self.parent[high as usize] = low;
                root = low;
            }
            self.number.push(root);
        }
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
        islands.find(8, pairs.into_iter());
        assert_eq!(islands.order, [2, 4, 5, 1, 0, 3]);
        assert_eq!(islands.ends, [3, 4, 6]);
    }
}
