//! Groups of columns of which a row sees at most one: differences of a group's columns are taken at once.

use super::Pattern;

/// The columns of a pattern in groups, and the group of each column.
#[derive(Debug, Clone)]
pub(super) struct Groups {
    pub(super) columns: Vec<Vec<usize>>,
    pub(super) of_column: Vec<usize>,
}

impl Groups {
    pub(super) fn of(pattern: &Pattern, columns: usize) -> Self {
        let groups = pattern.groups(columns);
        let mut of_column = vec![0; columns];
        for (k, group) in groups.iter().enumerate() {
            group.iter().for_each(|&j| of_column[j] = k);
        }
        Self { columns: groups, of_column }
    }

    /// Their number, in words.
    pub(super) fn said(&self) -> String {
        crate::plural(self.columns.len(), "colour")
    }
}

impl Pattern {
    /// Columns in groups such that no row has places in two columns of a group: greedy, from the first column on. Columns without a place are in the first
    /// group. Cost: for each place the length of its row.
    ///
    /// Source: CurtisPowellReid1974.
    pub fn groups(&self, columns: usize) -> Vec<Vec<usize>> {
        let mut rows = vec![vec![]; columns];
        self.places().for_each(|(i, j)| rows[j].push(i));
        // A full row sees every two.
        if (0..self.rows()).any(|i| self.row(i).len() == columns) {
            return (0..columns).map(|j| vec![j]).collect();
        }
        let mut group = vec![usize::MAX; columns];
        let mut groups: Vec<Vec<usize>> = vec![];
        // For which column a group was last seen to be taken.
        let mut taken: Vec<usize> = vec![];
        for j in 0..columns {
            for &i in &rows[j] {
                for &other in self.row(i) {
                    if let Some(taken) = taken.get_mut(group[other]) {
                        *taken = j;
                    }
                }
            }
            let free = taken.iter().position(|&by| by != j).unwrap_or(groups.len());
            if free == groups.len() {
                groups.push(vec![]);
                taken.push(usize::MAX);
            }
            group[j] = free;
            groups[free].push(j);
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_row_sees_two_columns_of_a_group() {
        let n = 50;
        let band = |i: usize| i.saturating_sub(1)..(i + 2).min(n);
        let tridiagonal = Pattern::new((0..n).map(band));
        assert_eq!(tridiagonal.groups(n).len(), 3);
        let arrow = Pattern::new(
            (0..n).map(|i| if i == 0 { (0..n).collect() } else { vec![0, i] }).map(Vec::into_iter),
        );
        assert_eq!(arrow.groups(n).len(), n);
        let scattered = Pattern::new((0..n).map(|i| {
            let mut row = vec![i, i * 7 % n, i * i % n];
            row.sort_unstable();
            row.dedup();
            row.into_iter()
        }));
        let groups = scattered.groups(n);
        assert!(groups.len() < 20);
        let mut all: Vec<_> = groups.iter().flatten().copied().collect();
        all.sort_unstable();
        assert_eq!(all, (0..n).collect::<Vec<_>>());
        for i in 0..n {
            for group in &groups {
                assert!(scattered.row(i).iter().filter(|j| group.contains(j)).count() <= 1);
            }
        }
    }
}
