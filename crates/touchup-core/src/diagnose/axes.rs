//! Axes of the wrench: a force points out of the surface that is pressed and, where the ball
//! slides, against its motion.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::finding::{InputCause, InputFinding};
use super::forces::{ForceLevels, axes_in_words, signed_permutations};
use super::input_record::InputRecord;
use crate::numeric::jackknife_variance;

/// Of the way that the ball slid, m: so short that it is straight, so long that no noise of the
/// pose turns it.
const COURSE: std::ops::RangeInclusive<f64> = 0.3e-3..=10e-3;
/// Records that are looked back for it.
const MOST_BACK: usize = 16;
/// It slides when its course is no steeper, as cosine to the normal.
const STEEP: f64 = 0.5;
/// Other axes explain the forces better when these lean less, as mean cosine to the scan's normal,
/// by this at least …
const LEAST_GAIN: f64 = 0.02;
/// … and the difference is so many standard errors; surely with so many.
const DOUBTED_ERRORS: f64 = 4.0;
const SURE_ERRORS: f64 = 6.0;
/// Stretches of the recording that the errors are estimated from.
const STRETCHES: usize = 16;
/// Fewer slides say nothing.
const FEWEST_SLIDES: usize = 2 * STRETCHES;
pub(super) const WRENCH_FRAME_REMEDY: &str = "the frame_id of the wrench names its axes: that of the pose the scan's, any other the stylus' own";

/// A ball that slides, in the axes in which the wrench was read; unit vectors.
struct Slide {
    force: Vector3<f64>,
    /// out of the scan
    normal: Vector3<f64>,
    course: Vector3<f64>,
}

/// Axes with which the forces of sliding lie better against the scan and against the motion than as
/// they were read.
#[derive(Clone, Copy, Debug)]
pub(super) struct OtherAxes {
    axes: Matrix3<f64>,
    /// mean cosine of the force to the normal, as it was read and with these axes
    leans: [f64; 2],
    /// mean share of the force that is against the motion: μ where the axes are right
    drags: [f64; 2],
    /// standard errors by which they are better
    errors: f64,
}

impl OtherAxes {
    /// The best of the 47 others; `None` where none is better.
    ///
    /// - `normals`: of the scan under each centre. `axes`: turns O into those in which the wrench
    ///   was read.
    pub fn of(
        records: &[InputRecord],
        levels: &ForceLevels,
        normals: impl FnOnce(&[&InputRecord]) -> Vec<Vector3<f64>>,
        axes: impl Fn(&InputRecord) -> UnitQuaternion<f64>,
    ) -> Option<Self> {
        let (sliding, courses): (Vec<&InputRecord>, Vec<Vector3<f64>>) =
            courses(records, levels).unzip();
        let under = normals(&sliding);
        let slides: Vec<Slide> = sliding
            .iter()
            .zip(courses)
            .zip(under)
            .filter(|((_, course), normal)| course.dot(normal).abs() < STEEP)
            .map(|((record, course), normal)| {
                let turn = axes(record);
                let force = (record.rotation * (record.force_t() - levels.rest_t)).normalize();
                Slide {
                    force: turn * force,
                    normal: turn * normal,
                    course: turn * course,
                }
            })
            .collect();
        if slides.len() < FEWEST_SLIDES {
            return None;
        }
        let lean = |axes: &Matrix3<f64>, slide: &Slide| (axes * slide.force).dot(&slide.normal);
        let drag = |axes: &Matrix3<f64>, slide: &Slide| -(axes * slide.force).dot(&slide.course);
        let mean_of = |of: &dyn Fn(&Slide) -> f64| mean(slides.iter().map(of));
        let as_read = Matrix3::identity();
        let lean_as_read = mean_of(&|slide| lean(&as_read, slide));
        let (_, axes) = signed_permutations()
            .skip(1)
            .filter(|axes| mean_of(&|slide| lean(axes, slide)) > lean_as_read + LEAST_GAIN)
            .map(|axes| {
                (
                    mean_of(&|slide| lean(&axes, slide) + drag(&axes, slide)),
                    axes,
                )
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        let gains = |of: &dyn Fn(&Matrix3<f64>, &Slide) -> f64| {
            let gains: Vec<f64> = slides
                .iter()
                .map(|slide| of(&axes, slide) - of(&as_read, slide))
                .collect();
            errors_of_mean(&gains)
        };
        let errors = gains(&drag).max(gains(&|axes, slide| lean(axes, slide) + drag(axes, slide)));
        let both = |of: &dyn Fn(&Matrix3<f64>, &Slide) -> f64| {
            [as_read, axes].map(|axes| mean_of(&|slide| of(&axes, slide)))
        };
        Some(Self {
            axes,
            leans: both(&lean),
            drags: both(&drag),
            errors,
        })
    }

    /// What is to be said of it.
    pub fn finding(&self) -> Option<InputFinding> {
        let degrees = self
            .leans
            .map(|cosine| cosine.clamp(-1.0, 1.0).acos().to_degrees());
        let measured = format!(
            "where the ball slides, the force leans {:.0}° from the scan's normal and {:.2} of it is against the motion; with its axes taken \
             as {} {:.0}° and {:.2}, which is better by {:.0} standard errors",
            degrees[0],
            self.drags[0],
            axes_in_words(&self.axes),
            degrees[1],
            self.drags[1],
            self.errors
        );
        (self.errors > DOUBTED_ERRORS).then(|| {
            InputFinding::new(
                InputCause::WrenchFrame,
                self.errors > SURE_ERRORS,
                measured,
                WRENCH_FRAME_REMEDY,
            )
        })
    }
}

/// Records that press and have slid there from another one that presses, all between them too, and
/// the unit vector of that way, in O.
fn courses<'a>(
    records: &'a [InputRecord],
    levels: &'a ForceLevels,
) -> impl Iterator<Item = (&'a InputRecord, Vector3<f64>)> {
    records
        .iter()
        .enumerate()
        .filter(|(_, record)| levels.is_pressing(record))
        .filter_map(|(at, record)| {
            let before = records[at.saturating_sub(MOST_BACK)..at].iter().rev();
            let ways = before
                .take_while(|other| levels.is_pressing(other))
                .map(|other| record.centre - other.centre);
            let way = ways.into_iter().find(|way| way.norm() >= *COURSE.start())?;
            COURSE
                .contains(&way.norm())
                .then(|| (record, way.normalize()))
        })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| {
        (sum + value, count + 1)
    });
    sum / count.max(1) as f64
}

/// A mean in standard errors, by the jackknife over stretches that follow each other.
fn errors_of_mean(values: &[f64]) -> f64 {
    let stretches: Vec<&[f64]> = values
        .chunks(values.len().div_ceil(STRETCHES).max(1))
        .collect();
    let without = |left_out: usize| {
        let others = stretches
            .iter()
            .enumerate()
            .filter(move |(at, _)| *at != left_out);
        mean(others.flat_map(|(_, stretch)| stretch.iter().copied()))
    };
    let without: Vec<f64> = (0..stretches.len()).map(without).collect();
    mean(values.iter().copied()) / jackknife_variance(&without).sqrt().max(f64::MIN_POSITIVE)
}
