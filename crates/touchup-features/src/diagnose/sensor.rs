//! Findings about the sensor, from the directions of the forces of sliding presses.

use nalgebra::{Matrix3, Vector3};

use super::finding::{FoundNumber, InputCause, InputFinding};
use super::judge::{InputJudge, Presses, TARE_REMEDY};
use super::session::{CLEAR_ODDS, DOUBTED_SIGMAS, SURE_SIGMAS};
use crate::adjustment::{ChangeCourse, ForceAdjustment, ForceFault, without_trace};

/// Standard uncertainty of a direction besides the scatter of strokes, rad: a friction that has a
/// preferred direction, and the lateral bend of a stylus.
const OF_MODEL_LEAN: f64 = 0.02;
const AXES_REMEDY: &str = "give the turn of the sensor (compensation.sensor_orientation_xyzw)";
const GAINS_REMEDY: &str =
    "calibrate the sensor: its axes have other gains, or read into each other";
const GAINS: [&str; 8] = [
    "gain_xx", "gain_xy", "gain_xz", "gain_yx", "gain_yy", "gain_yz", "gain_zx", "gain_zy",
];
const BIASES: [&str; 3] = ["bias_x_n", "bias_y_n", "bias_z_n"];
const TURNS: [&str; 3] = [
    "sensor_turn_x_deg",
    "sensor_turn_y_deg",
    "sensor_turn_z_deg",
];

impl InputJudge<'_> {
    /// A sensor that is turned, has other gains, or another zero.
    pub(super) fn force_finding(
        &self,
        presses: &Presses,
        adjusted: &ForceAdjustment,
    ) -> Option<InputFinding> {
        let fault = adjusted.fault;
        let unit = if fault.is_of_zero() {
            presses.levels.largest
        } else {
            1.0
        };
        let sigma = adjusted
            .sigma
            .map(|sigma| sigma.hypot(OF_MODEL_LEAN * unit));
        let sizes = adjusted.found.iter().zip(&sigma).take(fault.freedoms());
        let off = sizes.map(|(size, sigma)| size.abs() / sigma);
        let off = off.fold(0.0, f64::max);
        let size =
            |from: usize| [0, 1, 2].map(|axis| [adjusted.found[from + axis], sigma[from + axis]]);
        let in_words = |from: usize, unit: f64| {
            size(from)
                .map(|[value, sigma]| format!("{:.2} ± {:.2}", value * unit, sigma * unit))
                .join(", ")
        };
        let degrees = 1f64.to_degrees();
        let (cause, remedy, what) = match fault {
            ForceFault::Turned => (
                InputCause::WrenchFrame,
                AXES_REMEDY,
                format!("the sensor is turned by ({}) °", in_words(0, degrees)),
            ),
            ForceFault::Gains => (
                InputCause::ForceGains,
                GAINS_REMEDY,
                format!(
                    "its axes are, of those that are read, {}",
                    axes_of(&(Matrix3::identity() + without_trace(&adjusted.found)))
                ),
            ),
            ForceFault::Zero => (
                InputCause::Tare,
                TARE_REMEDY,
                format!("the zero of the sensor is off by ({}) N", in_words(0, 1.0)),
            ),
            ForceFault::ZeroChanged(course) => (
                InputCause::Tare,
                "tare the sensor in free air and only there, and record it again",
                format!(
                    "{} the zero of the sensor is off by ({}) N more",
                    self.course_in_words(course),
                    in_words(3, 1.0)
                ),
            ),
            ForceFault::Weight => (
                InputCause::Tare,
                TARE_REMEDY,
                format!("a weight of ({}) N is in the force", in_words(3, 1.0)),
            ),
        };
        let measured = format!(
            "the directions of the forces of {} sliding presses agree if {what}",
            adjusted.presses
        );
        let is_clear = adjusted.odds.iter().all(|odds| *odds > CLEAR_ODDS);
        (is_clear && off > DOUBTED_SIGMAS).then(|| {
            let numbers = self.force_numbers(presses, adjusted, &size);
            InputFinding::new(cause, off > SURE_SIGMAS, measured, remedy).with(numbers)
        })
    }

    /// - `size`: three values and their standard uncertainties from one on.
    fn force_numbers(
        &self,
        presses: &Presses,
        adjusted: &ForceAdjustment,
        size: &dyn Fn(usize) -> [[f64; 2]; 3],
    ) -> Vec<FoundNumber> {
        let named = |names: &[&'static str], from: usize, unit: f64| -> Vec<FoundNumber> {
            let sized = names.iter().zip(size(from));
            sized
                .map(|(name, [value, sigma])| FoundNumber::new(name, value * unit, sigma * unit))
                .collect()
        };
        match adjusted.fault {
            ForceFault::Turned => named(&TURNS, 0, 1f64.to_degrees()),
            ForceFault::Gains => {
                let gains = adjusted.found.iter().zip(&adjusted.sigma);
                let gains = GAINS.into_iter().zip(gains);
                gains
                    .map(|(name, (value, sigma))| FoundNumber::new(name, *value, *sigma))
                    .collect()
            }
            ForceFault::Zero => {
                let mut zero = named(&BIASES, 0, 1.0);
                for (number, rest) in zero.iter_mut().zip(&presses.levels.rest_t) {
                    number.value += rest;
                }
                zero
            }
            ForceFault::ZeroChanged(course) => {
                let mut change = named(&BIASES, 3, 1.0);
                if let ChangeCourse::At(at) = course {
                    change.push(FoundNumber::new("at_s", self.since_first(at), 0.0));
                }
                change
            }
            ForceFault::Weight => {
                let [x, y, z] = size(3);
                let weight = Vector3::new(x[0], y[0], z[0]);
                let sigma = Vector3::new(x[1], y[1], z[1]);
                let along = weight.normalize().component_mul(&sigma);
                vec![FoundNumber::new("weight_n", weight.norm(), along.norm())]
            }
        }
    }
}

/// A matrix in words, each axis by the shares of those that are read.
fn axes_of(matrix: &Matrix3<f64>) -> String {
    let row = |of: usize| {
        let of = matrix.row(of);
        format!("({:.2}, {:.2}, {:.2})", of[0], of[1], of[2])
    };
    [0, 1, 2].map(row).join(", ")
}
