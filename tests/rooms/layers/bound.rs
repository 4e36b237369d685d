//! Bounds that may only fall.

/// Of a count that is to fall to `wanted`.
pub struct Bound {
    /// the count of today: a change that lowers the count lowers this too
    pub today: usize,
    pub wanted: usize,
}

impl Bound {
    /// Complaint about a broken or stale bound.
    pub fn complaint(&self, count: usize) -> Option<String> {
        let Self { today, wanted } = *self;
        let reached = count.max(wanted);
        if count > today {
            let rule = "which may only fall";
            Some(format!(
                "{count} is above the bound {today}, {rule}, to {wanted}"
            ))
        } else if reached < today {
            Some(format!("lower the bound to {reached}"))
        } else {
            None
        }
    }

    /// Panics with the complaint and each of `cases`, which make up the count.
    pub fn hold_cases(&self, cases: &[String]) {
        if let Some(complaint) = self.complaint(cases.len()) {
            panic!("{complaint}\n{}", cases.join("\n"));
        }
    }

    /// Panics with the complaint.
    pub fn hold(&self, count: usize) {
        if let Some(complaint) = self.complaint(count) {
            panic!("{complaint}");
        }
    }
}

/// Rounded up, so that a bound is stale only when the rate is a whole unit lower.
pub fn per_thousand(cases: usize, of: usize) -> usize {
    (1000 * cases).div_ceil(of)
}

#[test]
fn a_bound_can_only_fall() {
    let bound = Bound {
        today: 5,
        wanted: 3,
    };
    let complaint = |count| bound.complaint(count).unwrap_or_default();
    assert_eq!(
        complaint(6),
        "6 is above the bound 5, which may only fall, to 3"
    );
    assert_eq!(complaint(5), "");
    assert_eq!(complaint(4), "lower the bound to 4");
    assert_eq!(complaint(1), "lower the bound to 3");
    let reached = Bound {
        today: 3,
        wanted: 3,
    };
    assert_eq!(reached.complaint(1), None);
    assert_eq!(per_thousand(6, 2000), 3);
    assert_eq!(per_thousand(5, 1690), 3, "2.96");
    assert_eq!(per_thousand(7, 2300), 4, "3.04");
}
