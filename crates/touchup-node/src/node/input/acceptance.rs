//! Use of the input: number of samples accepted lately, and reasons of the refusals.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

/// Window of recent counts.
const WINDOW: Duration = Duration::from_secs(2);
/// Period of stored counts within the window.
const KEPT_EVERY: Duration = Duration::from_millis(250);
/// Time after the start of both streams without a verdict on missing samples.
const SETTLES: Duration = Duration::from_secs(1);
/// Refusals unrelated to poses and wrenches.
const OF_OTHERS: [&str; 2] = ["bad_transform", "clicked_point"];

/// Minimum share of a cause among all refusals, one in 50: each bad pose costs ten wrenches or
/// more.
const FEWEST_OF_A_CAUSE: u64 = 50;

/// Counts since the start of the session.
#[derive(Clone, Debug)]
struct AcceptanceCounts {
    at: Instant,
    accepted: u64,
    refused: BTreeMap<String, u64>,
}

/// Recent fate of poses and wrenches.
#[derive(Clone, Debug, Default)]
pub struct Acceptance {
    counted: VecDeque<AcceptanceCounts>,
}

/// Verdict on the samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SampleVerdict {
    /// Both streams come, for too short a time for a verdict.
    Begins,
    /// Samples are accepted, and at most half of the input is refused.
    Accepts,
    /// Nothing is refused, and no sample is complete.
    PairsNone,
    /// Most messages are refused.
    Refuses {
        /// main reason
        reason: String,
        /// number of messages and samples refused for it
        count: u64,
        /// number of all refused or accepted
        of: u64,
    },
}

impl Acceptance {
    /// Forgets earlier counts, after a missing stream or skipped samples.
    pub fn restart(&mut self) {
        self.counted.clear();
    }

    /// Judges the samples; called from time to time while both streams come.
    ///
    /// - `accepted`, `refused`: since the start of the session.
    pub fn judge(
        &mut self,
        now: Instant,
        accepted: u64,
        refused: BTreeMap<String, u64>,
    ) -> SampleVerdict {
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
            None => SampleVerdict::Begins,
            Some(first) => first.verdict(since(first.at), accepted, &refused),
        };
        if self
            .counted
            .back()
            .is_none_or(|last| since(last.at) >= KEPT_EVERY)
        {
            self.counted.push_back(AcceptanceCounts {
                at: now,
                accepted,
                refused,
            });
        }
        verdict
    }
}

impl AcceptanceCounts {
    fn verdict(
        &self,
        over: Duration,
        accepted: u64,
        refused: &BTreeMap<String, u64>,
    ) -> SampleVerdict {
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
        // faults of the messages come before the pairing failures that they cause
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
                    SampleVerdict::Accepts
                } else {
                    SampleVerdict::Begins
                }
            }
            Some((reason, count)) if total > accepted => SampleVerdict::Refuses {
                reason,
                count,
                of: total + accepted,
            },
            _ if accepted == 0 => SampleVerdict::PairsNone,
            _ => SampleVerdict::Accepts,
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

/// Meaning and remedy of a reason of refusal.
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

    /// Judges every 5 ms for a duration, ms; in each ms `each` adds to accepted and to the refused,
    /// by reason.
    fn after(ms: u32, each: impl Fn(u32, &mut u64, &mut BTreeMap<String, u64>)) -> SampleVerdict {
        let (begun, mut acceptance) = (Instant::now(), Acceptance::default());
        let (mut accepted, mut refused, mut verdict) = (0, BTreeMap::new(), SampleVerdict::Begins);
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
        let SampleVerdict::Refuses { reason, count, of } = verdict else {
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
        assert_eq!(fewer, SampleVerdict::Accepts);
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
        assert!(matches!(after(1500, mended), SampleVerdict::Refuses { .. }));
        assert_eq!(after(3500, mended), SampleVerdict::Accepts);
        let broken = |at, accepted: &mut u64, refused: &mut _| {
            if at < 9000 {
                *accepted += 1
            } else {
                refuse(refused, "gap")
            }
        };
        assert!(matches!(
            after(11_000, broken),
            SampleVerdict::Refuses { .. }
        ));
        let none = |at, accepted: &mut u64, _: &mut _| *accepted += u64::from(at < 9000);
        assert_eq!(after(12_000, none), SampleVerdict::PairsNone);
    }

    #[test]
    fn a_begin_is_no_fault_and_refusals_of_other_messages_mean_nothing() {
        assert_eq!(
            after(900, |_, _, refused| refuse(refused, "no_pose_before")),
            SampleVerdict::Begins
        );
        assert!(matches!(
            after(1000, |_, _, refused| refuse(refused, "no_pose_before")),
            SampleVerdict::Refuses { .. }
        ));
        let others = |at, accepted: &mut u64, refused: &mut _| {
            *accepted += u64::from(at % 10 == 0);
            refuse(refused, "bad_transform");
        };
        assert_eq!(after(4000, others), SampleVerdict::Accepts);
    }
}
