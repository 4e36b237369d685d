//! Findings about the sensor, from the directions of the forces of sliding presses.

use nalgebra::Matrix3;

use super::finding::{FoundNumber, InputCause, InputFinding};
use super::judge::{InputJudge, Presses, TARE_REMEDY};
use super::session::{CLEAR_ODDS, DOUBTED_SIGMAS, SURE_SIGMAS};
use crate::adjustment::{FaultNumbers, ForceAdjustment, ForceFault, without_trace};
use touchup_method::stylus::ChangeCourse;

/// Standard uncertainty of a direction besides the scatter of strokes, rad: a friction that has a
/// preferred direction, and the lateral bend of a stylus.
const OF_MODEL_LEAN: f64 = 0.02;
const AXES_REMEDY: &str = "give the turn of the sensor (compensation.sensor_orientation_xyzw)";
const GAINS_REMEDY: &str =
    "calibrate the sensor: its axes have other gains, or read into each other";
const REZEROED_REMEDY: &str = "tare the sensor in free air and only there, and record it again";
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
        let sized = self.sized_fault(presses, adjusted);
        let (cause, remedy, what) = self.fault_in_words(&sized);
        let measured = format!(
            "the directions of the forces of {} sliding presses agree if {what}",
            adjusted.presses
        );
        let off = sized.sigmas_off();
        let is_clear = adjusted.odds.iter().all(|odds| *odds > CLEAR_ODDS);
        (is_clear && off > DOUBTED_SIGMAS).then(|| {
            let numbers = self.fault_numbers(&sized);
            InputFinding::new(cause, off > SURE_SIGMAS, measured, remedy).with(numbers)
        })
    }

    /// The fault beside the uncertainty of the model, and a zero with what is taken off already.
    fn sized_fault(&self, presses: &Presses, adjusted: &ForceAdjustment) -> SizedFault {
        let ForceAdjustment {
            fault,
            mut found,
            sigma,
            ..
        } = *adjusted;
        let levels = &presses.levels;
        let unit = if fault.is_of_zero() {
            levels.largest
        } else {
            1.0
        };
        if fault == ForceFault::Zero {
            for (zero, rest) in found.iter_mut().zip(&levels.rest_t) {
                *zero += rest;
            }
        }
        SizedFault {
            fault,
            found,
            sigma: sigma.map(|sigma| sigma.hypot(OF_MODEL_LEAN * unit)),
        }
    }

    /// Cause, remedy, and what is wrong.
    fn fault_in_words(&self, sized: &SizedFault) -> (InputCause, &'static str, String) {
        let zero = InputCause::Tare;
        match sized.fault {
            ForceFault::Turned => {
                let turn = sized.in_words(0, 1f64.to_degrees());
                let what = format!("the sensor is turned by ({turn}) °");
                (InputCause::WrenchFrame, AXES_REMEDY, what)
            }
            ForceFault::Gains => {
                let axes = axes_of(&(Matrix3::identity() + without_trace(&sized.found)));
                let what = format!("its axes are, of those that are read, {axes}");
                (InputCause::ForceGains, GAINS_REMEDY, what)
            }
            ForceFault::Zero => {
                let bias = sized.in_words(0, 1.0);
                let what = format!("the zero of the sensor is off by ({bias}) N");
                (zero, TARE_REMEDY, what)
            }
            ForceFault::ZeroChanged(course) => {
                let (when, bias) = (self.course_in_words(course), sized.in_words(3, 1.0));
                let what = format!("{when} the zero of the sensor is off by ({bias}) N more");
                (zero, REZEROED_REMEDY, what)
            }
            ForceFault::Weight => {
                let weight = sized.in_words(3, 1.0);
                let what = format!("a weight of ({weight}) N is in the force");
                (zero, TARE_REMEDY, what)
            }
        }
    }

    fn fault_numbers(&self, sized: &SizedFault) -> Vec<FoundNumber> {
        match sized.fault {
            ForceFault::Turned => sized.named(&TURNS, 0, 1f64.to_degrees()),
            ForceFault::Gains => sized.named(&GAINS, 0, 1.0),
            ForceFault::Zero => sized.named(&BIASES, 0, 1.0),
            ForceFault::ZeroChanged(course) => {
                let mut change = sized.named(&BIASES, 3, 1.0);
                if let ChangeCourse::At(at) = course {
                    change.push(FoundNumber::new("at_s", self.since_first(at), 0.0));
                }
                change
            }
            ForceFault::Weight => {
                let [weight, sigma] =
                    [&sized.found, &sized.sigma].map(|of| of.fixed_rows::<3>(3).into_owned());
                let along = weight.normalize().component_mul(&sigma);
                vec![FoundNumber::new("weight_n", weight.norm(), along.norm())]
            }
        }
    }
}

/// A fault with all that its size and uncertainty contain.
struct SizedFault {
    fault: ForceFault,
    found: FaultNumbers,
    sigma: FaultNumbers,
}

impl SizedFault {
    /// Largest number in its standard uncertainty.
    fn sigmas_off(&self) -> f64 {
        let sizes = self.found.iter().zip(&self.sigma);
        let off = sizes.map(|(size, sigma)| size.abs() / sigma);
        off.take(self.fault.freedoms()).fold(0.0, f64::max)
    }

    /// Three numbers from one on, in a unit.
    fn in_words(&self, from: usize, unit: f64) -> String {
        let words = [from, from + 1, from + 2].map(|at| {
            let (value, sigma) = (self.found[at] * unit, self.sigma[at] * unit);
            format!("{value:.2} ± {sigma:.2}")
        });
        words.join(", ")
    }

    /// Numbers from one on, in a unit.
    fn named(&self, names: &[&'static str], from: usize, unit: f64) -> Vec<FoundNumber> {
        let sizes = self.found.iter().zip(&self.sigma).skip(from);
        let named = names.iter().zip(sizes);
        named
            .map(|(name, (value, sigma))| FoundNumber::new(name, value * unit, sigma * unit))
            .collect()
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
