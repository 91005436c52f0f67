//! Disjoint sets, for connected components.

/// The numbers `0..n` in groups: each alone at first, then joined. Near constant cost for each call.
pub struct Groups {
    parent: Vec<usize>,
}

impl Groups {
    /// `n` groups of one.
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n).collect() }
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
        self.parent[i.max(j)] = i.min(j);
    }

    /// Makes one group of those of all these.
    pub fn join_all(&mut self, all: &[usize]) {
        all.windows(2).for_each(|two| self.join(two[0], two[1]));
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
