//! Disjoint sets, for connected components.

/// The numbers `0..n` in groups: each alone at first, then joined. Near constant cost for each call.
#[derive(Debug, Clone, Default)]
pub struct Groups {
    parent: Vec<usize>,
    count: usize,
}

impl Groups {
    /// `n` groups of one.
    pub fn new(n: usize) -> Self {
        let mut groups = Self::default();
        groups.restart(n);
        groups
    }

    /// Begins again with `n` groups of one, keeping the memory.
    pub fn restart(&mut self, n: usize) {
        self.parent.clear();
        self.parent.extend(0..n);
        self.count = n;
    }

    /// How many groups there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The least member of the group of `i`.
    pub fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    /// Makes one group of those of `i` and `j`.
    pub fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        if i != j {
            self.parent[i.max(j)] = i.min(j);
            self.count -= 1;
        }
    }

    /// Makes one group of those of all these.
    pub fn join_all(&mut self, all: &[usize]) {
        all.windows(2).for_each(|two| self.join(two[0], two[1]));
    }

    /// Whether the groups are those of these [`numbers`](Self::numbers).
    pub fn are(&mut self, numbers: &[usize]) -> bool {
        let count = numbers.iter().max().map_or(0, |most| most + 1);
        numbers.len() == self.parent.len()
            && count == self.count
            && (0..numbers.len()).all(|i| numbers[self.root(i)] == numbers[i])
    }

    /// The number of each member's group, counted from 0 in the order of their least members.
    pub fn numbers(&mut self) -> Vec<usize> {
        let mut numbers = Vec::with_capacity(self.parent.len());
        let mut groups = 0;
        for i in 0..self.parent.len() {
            // The root of a group comes before its other members.
            let root = self.root(i);
            numbers.push(if root == i { groups } else { numbers[root] });
            groups += usize::from(root == i);
        }
        numbers
    }

    /// The members of each group, ascending, in the order of the groups' least members.
    pub fn members(&mut self) -> Vec<Vec<usize>> {
        let mut members: Vec<Vec<usize>> = vec![];
        for (i, group) in self.numbers().into_iter().enumerate() {
            if group == members.len() {
                members.push(vec![]);
            }
            members[group].push(i);
        }
        members
    }

    /// The sizes of the groups, in the order of their least members.
    pub fn sizes(&mut self) -> Vec<usize> {
        let mut sizes = vec![];
        for group in self.numbers() {
            if group == sizes.len() {
                sizes.push(0);
            }
            sizes[group] += 1;
        }
        sizes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_counted_and_begin_again() {
        let mut groups = Groups::new(4);
        groups.join(0, 2);
        groups.join(2, 0);
        assert_eq!(groups.count(), 3);
        groups.join_all(&[0, 3, 2]);
        assert_eq!((groups.count(), groups.members()), (2, vec![vec![0, 2, 3], vec![1]]));
        assert!(
            groups.are(&[0, 1, 0, 0]) && !groups.are(&[0, 1, 1, 0]) && !groups.are(&[0, 0, 0, 0])
        );
        groups.restart(2);
        assert_eq!((groups.count(), groups.numbers()), (2, vec![0, 1]));
    }

    #[test]
    fn groups_and_their_sizes() {
        let mut groups = Groups::new(7);
        groups.join(3, 0);
        groups.join(3, 6);
        groups.join(4, 5);
        assert_eq!(groups.root(6), 0);
        assert_eq!(groups.numbers(), [0, 1, 2, 0, 3, 3, 0]);
        assert_eq!(groups.members(), [vec![0, 3, 6], vec![1], vec![2], vec![4, 5]]);
        assert_eq!(groups.sizes(), [3, 1, 1, 2]);
        groups.join_all(&[0, 1, 2, 4]);
        assert_eq!(groups.sizes(), [7]);
    }
}
