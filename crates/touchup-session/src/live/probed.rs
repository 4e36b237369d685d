//! Touches for the measurement of features, from the thread of the patch.

use touchup_method::stylus::ProbedPoint;

/// Changes of a list of touches: the first `kept` stay, `new` follow.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchDelta {
    /// number of earlier touches that stay
    pub kept: usize,
    /// touches after them
    pub new: Vec<ProbedPoint>,
}

impl Default for TouchDelta {
    /// All stay, none is new.
    fn default() -> Self {
        Self {
            kept: usize::MAX,
            new: Vec::new(),
        }
    }
}

impl TouchDelta {
    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        self.kept == usize::MAX && self.new.is_empty()
    }

    /// Adds a later change.
    pub fn extend(&mut self, next: Self) {
        if next.is_empty() {
            return;
        }
        let ours = self.new.len();
        // `next` counts from the earlier list, with ours behind it
        match self.kept {
            usize::MAX if ours == 0 => self.kept = next.kept,
            kept if next.kept >= kept => self.new.truncate(next.kept - kept),
            _ => {
                self.kept = next.kept;
                self.new.clear();
            }
        }
        self.new.extend(next.new);
    }

    /// Brings a list up to date.
    pub fn apply_to(self, touches: &mut Vec<ProbedPoint>) {
        touches.truncate(self.kept);
        touches.extend(self.new);
    }
}

/// The published part of a list.
#[derive(Debug, Default)]
pub(super) struct PublishedList {
    count: usize,
    /// stamp and stroke of the last published touch
    last: Option<(i64, u32)>,
}

fn name(touch: &ProbedPoint) -> (i64, u32) {
    (touch.stamp_ns, touch.stroke)
}

impl PublishedList {
    /// The message about the current list: the new touches, or the whole list after a removal.
    pub fn changes(&mut self, touches: &[ProbedPoint]) -> TouchDelta {
        let is_longer = self
            .count
            .checked_sub(1)
            .and_then(|last| touches.get(last))
            .map(name)
            == self.last;
        let kept = if is_longer { self.count } else { 0 };
        if kept == touches.len() && is_longer {
            return TouchDelta::default();
        }
        self.publish(touches, kept)
    }

    /// The message about a list with another history: all of it.
    pub fn all(&mut self, touches: &[ProbedPoint]) -> TouchDelta {
        self.publish(touches, 0)
    }

    fn publish(&mut self, touches: &[ProbedPoint], kept: usize) -> TouchDelta {
        self.count = touches.len();
        self.last = touches.last().map(name);
        TouchDelta {
            kept,
            new: touches[kept..].to_vec(),
        }
    }
}
