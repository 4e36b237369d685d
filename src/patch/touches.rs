//! From compensated tips to touches: where the ball really was, and what it touched there.
//!
//! The patch follows a few tens of milliseconds behind the stream, so position and force are smoothed by a window that
//! looks as far ahead as back: it does not lag.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use crate::touch::{BiasParams, BiasTracker, ContactGate, ContactGateParams, SettingError, Tip};

/// How touches are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchFinderParams {
    /// radius of the ball, m
    pub radius: f64,
    /// what stylus and probe give way under force, N/m; `None`: rigid
    pub stiffness: Option<f64>,
    /// tells contact from free motion
    pub gate: ContactGateParams,
    /// half of the smoothing window, ns. Default 16 ms: 0.2 mm of pose noise at 500 Hz then becomes 0.05 mm, and a velocity of
    /// 25 mm/s is known to 5 mm/s.
    pub half_window_ns: i64,
    /// a pause longer than this parts the stream, ns. Default 30 ms.
    pub largest_gap_ns: i64,
    /// slower than this the ball counts as being at rest, m/s. Default 8 mm/s.
    pub slowest: f64,
    /// cosine of the widest friction cone believed. Default cos 24°.
    pub cone_cosine: f64,
    /// weight of a touch whose normal is the force itself, beside 1 where friction was taken out. Default 0.1.
    pub resting_weight: f64,
}

impl TouchFinderParams {
    /// The defaults, for one tip.
    pub fn new(radius: f64, stiffness: Option<f64>) -> Self {
        Self {
            radius,
            stiffness,
            gate: ContactGateParams::default(),
            half_window_ns: 16_000_000,
            largest_gap_ns: 30_000_000,
            slowest: 8e-3,
            cone_cosine: 0.9135,
            resting_weight: 0.1,
        }
    }
}

/// What the ball touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// point of the surface, m, in O
    pub point: Point3<f64>,
    /// outward unit normal of the surface there, in O
    pub normal: Vector3<f64>,
    /// how much it counts beside others; 1 for a sliding ball
    pub weight: f64,
}

/// The ball at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// ns
    pub stamp_ns: i64,
    /// centre of the real ball, m, in O
    pub centre: Point3<f64>,
    /// `None` in free motion
    pub contact: Option<Contact>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    stamp_ns: i64,
    centre: Point3<f64>,
    force_o: Vector3<f64>,
    in_contact: bool,
}

/// Finds touches in a stream of tips.
#[derive(Clone, Debug)]
pub struct TouchFinder {
    params: TouchFinderParams,
    gate: ContactGate,
    bias: BiasTracker,
    /// samples since the last gap, as far as a window may still need them
    held: VecDeque<Entry>,
    /// the first of `held` whose touch has not been given out
    next: usize,
}

impl TouchFinder {
    /// # Errors
    /// [`SettingError`] of the gate.
    pub fn new(params: TouchFinderParams) -> Result<Self, SettingError> {
        Ok(Self {
            gate: ContactGate::new(params.gate)?,
            params,
            bias: BiasTracker::new(BiasParams::default())?,
            held: VecDeque::new(),
            next: 0,
        })
    }

    /// Takes the next tip, which is later than the one before; gives each touch whose window is complete to `each`.
    pub fn push(&mut self, tip: &Tip, mut each: impl FnMut(Touch)) {
        if self.held.back().is_some_and(|last| tip.stamp_ns - last.stamp_ns > self.params.largest_gap_ns) {
            self.flush(&mut each);
        }
        let force_o = self.bias.compensate(tip);
        let bend = self.params.stiffness.map_or_else(Vector3::zeros, |stiffness| force_o / stiffness);
        self.held.push_back(Entry {
            stamp_ns: tip.stamp_ns,
            centre: Point3::from(tip.pose_ot.translation.vector + bend),
            force_o,
            in_contact: self.gate.update(tip.stamp_ns, &force_o).is_some(),
        });
        while self.held[self.next].stamp_ns + self.params.half_window_ns <= tip.stamp_ns {
            each(self.touch(self.next));
            self.next += 1;
        }
        let needed = self.held[self.next.min(self.held.len() - 1)].stamp_ns - self.params.half_window_ns;
        while self.held[0].stamp_ns < needed {
            self.held.pop_front();
            self.next -= 1;
        }
    }

    /// Gives out what is held: the stream has ended or paused.
    pub fn flush(&mut self, mut each: impl FnMut(Touch)) {
        for at in self.next..self.held.len() {
            each(self.touch(at));
        }
        self.held.clear();
        self.next = 0;
    }

    fn touch(&self, at: usize) -> Touch {
        let middle = &self.held[at];
        let window = |entry: &&Entry| (entry.stamp_ns - middle.stamp_ns).abs() <= self.params.half_window_ns;
        let (mut count, mut centre, mut force) = (0.0, Vector3::zeros(), Vector3::zeros());
        let (mut time, mut times, mut way) = (0.0, 0.0, Vector3::zeros());
        let mut is_steady = true;
        for entry in self.held.iter().filter(window) {
            is_steady &= entry.in_contact;
            let t = (entry.stamp_ns - middle.stamp_ns) as f64 * 1e-9;
            let arm = entry.centre - middle.centre;
            count += 1.0;
            centre += arm;
            force += entry.force_o;
            time += t;
            times += t * t;
            way += arm * t;
        }
        let spread = times - time * time / count;
        let velocity = if spread > 0.0 { (way - centre * (time / count)) / spread } else { Vector3::zeros() };
        let centre = middle.centre + centre / count;
        let contact = if is_steady { self.contact(&centre, &force, &velocity) } else { None };
        Touch { stamp_ns: middle.stamp_ns, centre, contact }
    }

    fn contact(&self, centre: &Point3<f64>, force: &Vector3<f64>, velocity: &Vector3<f64>) -> Option<Contact> {
        let along_force = force.try_normalize(0.0)?;
        let (mut normal, mut weight) = (along_force, self.params.resting_weight);
        if velocity.norm() > self.params.slowest {
            let sliding = velocity.normalize();
            let across = along_force - sliding * along_force.dot(&sliding);
            if across.norm() >= self.params.cone_cosine {
                (normal, weight) = (across.normalize(), 1.0);
            }
        }
        Some(Contact { point: centre - normal * self.params.radius, normal, weight })
    }
}
