//! Whether what comes is used: how many samples were accepted lately, and why the others were not.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

/// What counts as lately.
const WINDOW: Duration = Duration::from_secs(2);
/// Counts are kept so often within it.
const KEPT_EVERY: Duration = Duration::from_millis(250);
/// So soon after both streams began nothing is said of what does not come.
const SETTLES: Duration = Duration::from_secs(1);
/// Refusals that mean nothing for poses and wrenches.
const OF_OTHERS: [&str; 2] = ["bad_transform", "clicked_point"];

/// What is one in so many of all that is refused may be the cause of the others: ten wrenches miss
/// each pose, and more.
const FEWEST_OF_A_CAUSE: u64 = 50;

/// Counts since the session began.
#[derive(Clone, Debug)]
struct Counted {
    at: Instant,
    accepted: u64,
    refused: BTreeMap<String, u64>,
}

/// What became of poses and wrenches lately.
#[derive(Clone, Debug, Default)]
pub struct Acceptance {
    counted: VecDeque<Counted>,
}

/// How it stands with the samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Both streams come, for too short a time to say more.
    Begins,
    /// Samples are accepted, and most of what comes is.
    Accepts,
    /// Nothing is refused, and no sample is complete.
    PairsNone,
    /// Most of what comes is refused.
    Refuses {
        /// the main reason
        reason: String,
        /// messages and samples that were refused for it
        count: u64,
        /// all that were refused or accepted
        of: u64,
    },
}

impl Acceptance {
    /// A stream is away, or samples are passed over: what was before says nothing of what comes.
    pub fn restart(&mut self) {
        self.counted.clear();
    }

    /// To be called from time to time while both streams come.
    ///
    /// - `accepted`, `refused`: since the session began.
    pub fn judge(
        &mut self,
        now: Instant,
        accepted: u64,
        refused: BTreeMap<String, u64>,
    ) -> Verdict {
        let since = |at: Instant| now.saturating_duration_since(at);
        if self
            .counted
            .front()
            .is_some_and(|first| first.accepted > accepted)
        {
            // another session
            self.restart();
        }
        while self
            .counted
            .get(1)
            .is_some_and(|second| since(second.at) >= WINDOW)
        {
            self.counted.pop_front();
        }
        let verdict = match self.counted.front() {
            None => Verdict::Begins,
            Some(first) => first.verdict(since(first.at), accepted, &refused),
        };
        if self
            .counted
            .back()
            .is_none_or(|last| since(last.at) >= KEPT_EVERY)
        {
            self.counted.push_back(Counted {
                at: now,
                accepted,
                refused,
            });
        }
        verdict
    }
}

impl Counted {
    fn verdict(&self, over: Duration, accepted: u64, refused: &BTreeMap<String, u64>) -> Verdict {
        let accepted = accepted - self.accepted;
        let lately = |(reason, count): (&String, &u64)| {
            (
                reason.clone(),
                count.saturating_sub(self.refused.get(reason).copied().unwrap_or(0)),
            )
        };
        let refused: BTreeMap<String, u64> = refused
            .iter()
            .filter(|(reason, _)| !OF_OTHERS.contains(&reason.as_str()))
            .map(lately)
            .collect();
        let total: u64 = refused.values().sum();
        // what is wrong with the messages comes before what it has wrenches miss
        let is_cause = |(reason, count): &(&String, &u64)| {
            !is_of_pairing(reason) && total <= count.saturating_mul(FEWEST_OF_A_CAUSE)
        };
        let most = |(_, count): &(&String, &u64)| **count;
        let main = refused
            .iter()
            .filter(is_cause)
            .max_by_key(most)
            .or_else(|| refused.iter().max_by_key(most));
        let main = main.map(|(reason, count)| (reason.clone(), *count));
        match main {
            _ if over < SETTLES => {
                if accepted > 0 {
                    Verdict::Accepts
                } else {
                    Verdict::Begins
                }
            }
            Some((reason, count)) if total > accepted => Verdict::Refuses {
                reason,
                count,
                of: total + accepted,
            },
            _ if accepted == 0 => Verdict::PairsNone,
            _ => Verdict::Accepts,
        }
    }
}

/// Whether a wrench found no poses around it.
pub fn is_of_pairing(reason: &str) -> bool {
    matches!(
        reason,
        "gap" | "no_pose_before" | "no_pose_after" | "overflow"
    )
}

/// What a reason of refusal means, and what to do about it.
pub fn meaning(reason: &str) -> &'static str {
    match reason.strip_prefix("pose_").unwrap_or(reason) {
        "no_frame" => "headers name no frame: fill frame_id at the source",
        "unknown_frame" => "their frame is in no transform: publish it on /tf or /tf_static",
        "transform" => "their frames are not connected at their stamps: look at /tf",
        "transforms_apart" => {
            "links up to pose_frame are published too far apart in time: publish them more often, or name other frames"
        }
        "quaternion" => "orientations are no rotations: normalise the quaternion at its source",
        "stamp" => "stamps are no time between 1970 and 2038: look at the clock of the source",
        "duplicate" => {
            "one stamp comes again and again: does the source fill header.stamp, and is it the only one?"
        }
        "late" => "stamps are older than those before: is more than one source on the topic?",
        "not_finite" => "numbers are NaN or infinite: look at the source",
        "absurd" => "numbers are too large for a stylus: are they in m, N and N m?",
        "jump" => "stamps leap about: look at the clock of the source",
        "gap" => {
            "the two poses around a wrench are too far apart: send poses more often, or raise sync.largest_gap_ms"
        }
        "no_pose_before" | "no_pose_after" | "overflow" => "no pose is stamped like the wrenches",
        "axes_changed" => "wrenches come in other axes than before: call ~/reset",
        "unreadable" => "messages cannot be read: is the type of the topic right?",
        _ => "the haptic update does not take them",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Judges every 5 ms for so many ms; in each ms `each` adds to accepted and to the refused, by
    /// reason.
    fn after(ms: u32, each: impl Fn(u32, &mut u64, &mut BTreeMap<String, u64>)) -> Verdict {
        let (begun, mut acceptance) = (Instant::now(), Acceptance::default());
        let (mut accepted, mut refused, mut verdict) = (0, BTreeMap::new(), Verdict::Begins);
        for at in 0..=ms {
            each(at, &mut accepted, &mut refused);
            if at % 5 == 0 {
                verdict = acceptance.judge(begun + at * MS, accepted, refused.clone());
            }
        }
        verdict
    }

    fn refuse(refused: &mut BTreeMap<String, u64>, reason: &str) {
        *refused.entry(reason.to_owned()).or_default() += 1;
    }

    #[test]
    fn what_is_refused_mostly_is_said_with_its_cause() {
        let verdict = after(5000, |at, accepted, refused| match at % 10 {
            0..4 => *accepted += 1,
            4..8 => refuse(refused, "gap"),
            _ => refuse(refused, "late"),
        });
        let Verdict::Refuses { reason, count, of } = verdict else {
            panic!("{verdict:?}")
        };
        // the window is 2 s and up to 250 ms more
        assert_eq!((reason.as_str(), count * 10), ("late", of * 2));
        assert!((2000..=2250).contains(&of), "{of}");
        let fewer = after(5000, |at, accepted, refused| {
            if at % 10 < 6 {
                *accepted += 1
            } else {
                refuse(refused, "gap")
            }
        });
        assert_eq!(fewer, Verdict::Accepts);
    }

    #[test]
    fn what_was_long_ago_does_not_count() {
        let mended = |at, accepted: &mut u64, refused: &mut _| {
            if at < 1000 {
                refuse(refused, "gap")
            } else {
                *accepted += 1
            }
        };
        assert!(matches!(after(1500, mended), Verdict::Refuses { .. }));
        assert_eq!(after(3500, mended), Verdict::Accepts);
        let broken = |at, accepted: &mut u64, refused: &mut _| {
            if at < 9000 {
                *accepted += 1
            } else {
                refuse(refused, "gap")
            }
        };
        assert!(matches!(after(11_000, broken), Verdict::Refuses { .. }));
        let none = |at, accepted: &mut u64, _: &mut _| *accepted += u64::from(at < 9000);
        assert_eq!(after(12_000, none), Verdict::PairsNone);
    }

    #[test]
    fn a_begin_is_no_fault_and_refusals_of_other_messages_mean_nothing() {
        assert_eq!(
            after(900, |_, _, refused| refuse(refused, "no_pose_before")),
            Verdict::Begins
        );
        assert!(matches!(
            after(1000, |_, _, refused| refuse(refused, "no_pose_before")),
            Verdict::Refuses { .. }
        ));
        let others = |at, accepted: &mut u64, refused: &mut _| {
            *accepted += u64::from(at % 10 == 0);
            refuse(refused, "bad_transform");
        };
        assert_eq!(after(4000, others), Verdict::Accepts);
    }
}
