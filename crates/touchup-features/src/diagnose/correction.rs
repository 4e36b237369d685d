//! What takes a finding off.

use nalgebra::{Vector3, Vector6};

use crate::adjustment::{ChangeCause, LikelyChange, SessionNumbers};
use touchup_method::stylus::{ChangeCourse, ClockOffset, KnownChange};

/// Standard uncertainties before the presses: whatever they show.
pub(super) const ANY: SessionNumbers = SessionNumbers {
    compliance: 1e-3,
    offset_t: Vector3::new(10e-3, 10e-3, 10e-3),
    change: Vector6::new(10e-3, 10e-3, 10e-3, 0.2, 0.2, 0.2),
};
/// Largest standard uncertainty of a known size, as a share of that before the presses.
const KNOWN_SHARE: f64 = 0.5;
/// Fewest standard uncertainties of a sink that gives a stiffness.
const LEAST_SIGMAS: f64 = 2.0;

/// Numbers that take a finding off, with their standard uncertainties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputCorrection {
    /// What changed its place while the recording lasted.
    Change(KnownChange),
    /// The ball is elsewhere on the stylus than it is told.
    TipOffset {
        /// its place from the told one, m, in T; 0 where the presses do not determine it
        offset: Vector3<f64>,
        /// standard uncertainty along the worst axis that they determine, m
        sigma: f64,
    },
    /// The ball sinks by another slope than it is told.
    Compliance {
        /// sink of the ball, m/N; above 0
        compliance: f64,
        /// standard uncertainty, m/N
        sigma: f64,
    },
    /// Reading of the wrench clock, beyond what is taken off already.
    WrenchClock(ClockOffset),
}

impl InputCorrection {
    /// `None` for what is no change of place.
    ///
    /// - `found`: numbers of the session with their standard uncertainties.
    pub(super) fn of_change(
        LikelyChange { change, .. }: &LikelyChange,
        [found, sigma]: [&SessionNumbers; 2],
    ) -> Option<Self> {
        let rows = |of: &SessionNumbers, from: usize| of.change.fixed_rows::<3>(from).into_owned();
        let turns = change.cause == ChangeCause::PartMoved;
        let turn = |of: &SessionNumbers| if turns { rows(of, 3) } else { Vector3::zeros() };
        let (from, to) = match change.course {
            ChangeCourse::At(at) => (at, None),
            ChangeCourse::Between(from, to) => (from, Some(to)),
        };
        let of_place = |cause| KnownChange {
            cause,
            from: Some(from),
            to,
            shift: rows(found, 0),
            turn: turn(found),
            about: change.about,
            shift_sigma: rows(sigma, 0),
            turn_sigma: turn(sigma),
        };
        change.cause.changed().map(of_place).map(Self::Change)
    }

    /// An axis that the presses do not show keeps its told place.
    ///
    /// - `found`, `sigma`: place from the told one and its standard uncertainty, m, in T.
    pub(super) fn of_place(found: &Vector3<f64>, sigma: &Vector3<f64>) -> Self {
        let is_shown = |sigma: f64, before: f64| f64::from(is_known(sigma, before));
        let is_known = sigma.zip_map(&ANY.offset_t, is_shown);
        Self::TipOffset {
            offset: found.component_mul(&is_known),
            sigma: sigma.component_mul(&is_known).max(),
        }
    }

    /// `None` for a clock that was set while it ran: no setting has two offsets.
    pub(super) fn of_clock(found: ClockOffset) -> Option<Self> {
        found.step().is_none().then_some(Self::WrenchClock(found))
    }

    /// Whether the presses show all of it.
    pub fn is_whole(&self) -> bool {
        let Self::Change(change) = self else {
            return true;
        };
        let sigma = change.shift_sigma.iter().chain(&change.turn_sigma);
        let mut sizes = sigma.zip(&ANY.change);
        sizes.all(|(sigma, before)| is_known(*sigma, *before))
    }

    /// `None` for a ball that may be rigid.
    pub(super) fn of_compliance(compliance: f64, sigma: f64) -> Option<Self> {
        (compliance > LEAST_SIGMAS * sigma).then_some(Self::Compliance { compliance, sigma })
    }
}

/// Whether the presses show a size.
pub(super) fn is_known(sigma: f64, before: f64) -> bool {
    sigma < KNOWN_SHARE * before
}
