//! Colours of signed deviations, safe for the colour-blind: blue lacks material, white fits, red
//! has too much. And colours of classes of disagreement.

use super::disagreement::Class;

/// Red, green and blue, 0 to 255 each, sRGB.
pub type Rgb = [u8; 3];

/// From −1 to 1 in equal steps: dark to light blue, nearly white, light to dark red.
const STOPS: [[f64; 3]; 9] = [
    [18.0, 44.0, 108.0],
    [38.0, 92.0, 168.0],
    [92.0, 150.0, 207.0],
    [170.0, 205.0, 232.0],
    [246.0, 245.0, 242.0],
    [249.0, 200.0, 164.0],
    [232.0, 132.0, 92.0],
    [196.0, 58.0, 50.0],
    [122.0, 12.0, 32.0],
];

/// The colour of `deviation` on a scale from −`range` to `range` (m, more than 0); values beyond
/// have the colour of their end.
pub fn colour_of(deviation: f64, range: f64) -> Rgb {
    let last = STOPS.len() - 1;
    let at = ((deviation / range).clamp(-1.0, 1.0) + 1.0) / 2.0 * last as f64;
    // NaN becomes 0
    let below = (at as usize).min(last - 1);
    let part = at - below as f64;
    std::array::from_fn(|i| {
        (STOPS[below][i] + (STOPS[below + 1][i] - STOPS[below][i]) * part).round() as u8
    })
}

/// Colours of deviations, with one colour for all within tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColourScale {
    /// half the range of the scale, m, more than 0
    pub range: f64,
    /// maximum deviation with the colour of 0, m
    pub tolerance: Option<f64>,
}

impl ColourScale {
    pub(crate) fn colour(&self, deviation: f64) -> Rgb {
        let is_within = self
            .tolerance
            .is_some_and(|tolerance| deviation.abs() <= tolerance);
        colour_of(if is_within { 0.0 } else { deviation }, self.range)
    }
}

/// The colour of a class, distinct also for the colour-blind.
pub fn colour_of_class(class: Class) -> Rgb {
    match class {
        Class::Agrees => [238, 240, 242],
        Class::ScannerError => [112, 176, 224],
        Class::ChangedPart => [204, 76, 20],
        Class::BadTouch => [92, 20, 110],
        Class::Unsure => [244, 192, 62],
        Class::NeverTouched => [170, 172, 176],
        Class::Unreachable => [96, 98, 104],
    }
}

#[cfg(test)]
#[path = "../../../../tests/common/colour_vision.rs"]
mod colour_vision;

#[cfg(test)]
mod tests {
    use super::colour_vision::least_difference;
    use super::*;

    #[test]
    fn classes_are_apart_without_red_and_green() {
        // ten times the just noticeable difference
        assert!(least_difference(&Class::ALL.map(colour_of_class)) > 23.0);
        let former_pair = [[204, 56, 40], [20, 130, 60]];
        assert!(
            least_difference(&former_pair) < 15.0,
            "red and green of one brightness are not"
        );
    }

    #[test]
    fn ends_and_middle_are_as_listed_and_what_is_beyond_is_clipped() {
        for (deviation, stop) in [
            (-2.0, 0),
            (-9.0, 0),
            (0.0, 4),
            (1.0, 6),
            (2.0, 8),
            (f64::INFINITY, 8),
        ] {
            assert_eq!(
                colour_of(deviation, 2.0).map(f64::from),
                STOPS[stop],
                "{deviation}"
            );
        }
        assert_eq!(colour_of(-0.25, 2.0), [208, 225, 237]);
    }
}
