//! Measured features in the drawing frame: the rigid motion of the part into that frame, by best
//! fit or datums, and its share of the uncertainty of places.

mod error;
mod method;
mod start;

use nalgebra::{Isometry3, Point3, Vector3};

pub use self::error::AlignmentError;
pub use self::method::AlignmentMethod;
use self::start::{is_aligned_by, start_of_named, start_of_pattern};
use super::drawn_feature::{DrawnFeature, shape_of};
use touchup_features::align::{DatumFit, DatumPair, fit_datums};
use touchup_features::conformity::{FeatureMatch, FeaturePlace, SoughtFeature, match_features};
use touchup_features::features::{Feature, FittedTo};
use touchup_io::features_file::{FeatureFile, FeatureRecord};
use touchup_io::inspection_file::{AlignedFeatureRecord, AlignmentRecord};

/// Rounds of matching and fitting; later rounds hardly change the matches.
const MOST_ROUNDS: usize = 4;
/// Most names in an error.
const MOST_NAMED: usize = 12;

/// Measurement in the drawing frame.
pub struct Alignment {
    /// places and axes moved; their uncertainties relate to the drawing frame
    pub features: FeatureFile,
    /// takes O into the drawing frame
    pub motion: Isometry3<f64>,
    /// record for the report
    pub record: AlignmentRecord,
    /// unused features of the drawing, by name
    pub unused: Vec<String>,
}

/// A feature of the drawing, by its number, and its measured counterpart.
#[derive(Clone, PartialEq)]
struct MatchedFeature {
    drawn: usize,
    pair: DatumPair,
    id: u32,
}

/// Aligns the measured features with the drawing.
///
/// - `match_mm`: largest distance of a feature from its nominal place.
///
/// # Errors
/// [`AlignmentError`]
pub fn aligned(
    drawn: &[DrawnFeature],
    file: &FeatureFile,
    method: &AlignmentMethod,
    match_mm: f64,
) -> Result<Alignment, AlignmentError> {
    if !drawn.iter().any(|one| one.has_place) {
        return Err(AlignmentError::NoPlaces);
    }
    let measured: Vec<Feature> = file.features.iter().filter_map(shape_of).collect();
    let reach = match_mm * 1e-3;
    let datums = match method {
        AlignmentMethod::BestFit => None,
        AlignmentMethod::Datums(names) => Some(
            names
                .iter()
                .map(|name| datum_of(drawn, name))
                .collect::<Result<Vec<_>, _>>()?,
        ),
    };
    let mut motion = start(drawn, &measured, datums.as_deref(), reach)?;
    let mut before = Vec::new();
    for _ in 0..MOST_ROUNDS {
        let matched = matched(drawn, &measured, &motion, reach);
        let used = match &datums {
            None => matched
                .iter()
                .filter_map(|one| one.as_ref().ok().cloned())
                .collect(),
            Some(datums) => of_datums(drawn, datums, &matched)?,
        };
        if used == before {
            break;
        }
        let fit = fitted(drawn, &used, datums.is_some(), &motion)?;
        (motion, before) = (fit.motion, used);
    }
    let fit = fitted(drawn, &before, datums.is_some(), &motion)?;
    let worst = before
        .iter()
        .zip(&fit.residuals)
        .max_by(|a, b| a.1.total_cmp(b.1));
    if let Some((one, residual)) = worst.filter(|(_, residual)| **residual > reach) {
        let name = drawn[one.drawn].name().to_owned();
        return Err(AlignmentError::Residual {
            name,
            residual_mm: residual * 1e3,
            limit_mm: match_mm,
        });
    }
    let is_unused = |at: &usize| datums.is_none() && before.iter().all(|one| one.drawn != *at);
    let could_be = |at: &usize| is_aligned_by(drawn[*at].shape.kind) && drawn[*at].has_place;
    let unused = (0..drawn.len())
        .filter(is_unused)
        .filter(could_be)
        .map(|at| drawn[at].name().to_owned())
        .collect();
    Ok(Alignment {
        features: moved(file, &measured, &before, &fit),
        motion: fit.motion,
        record: record_of(drawn, &before, &fit, method),
        unused,
    })
}

/// Start of the search: from the features that the drawing names if it names all features in use,
/// else from the pattern of all features.
fn start(
    drawn: &[DrawnFeature],
    measured: &[Feature],
    datums: Option<&[usize]>,
    reach: f64,
) -> Result<Isometry3<f64>, AlignmentError> {
    let is_wanted = |at: &usize| datums.is_none_or(|datums| datums.contains(at));
    let is_placed = |at: &usize| drawn[*at].has_place && is_aligned_by(drawn[*at].shape.kind);
    let wanted: Vec<usize> = (0..drawn.len())
        .filter(is_wanted)
        .filter(is_placed)
        .collect();
    if wanted.iter().any(|&at| drawn[at].id.is_none()) {
        return start_of_pattern(drawn, measured);
    }
    let named = wanted.into_iter().filter_map(|at| {
        let one = &drawn[at];
        let found = measured
            .iter()
            .find(|feature| Some(feature.id) == one.id && feature.kind == one.shape.kind)?;
        paired(at, one, found).ok()
    });
    let named: Vec<_> = named.collect();
    let pairs: Vec<_> = named.iter().map(|one| one.pair).collect();
    start_of_named(&pairs, reach, |error| AlignmentError::Open {
        error,
        used: names_of(drawn, &named),
    })
}

/// Pairs each drawing feature with its measured counterpart after a motion, or says why it has
/// none.
fn matched(
    drawn: &[DrawnFeature],
    measured: &[Feature],
    motion: &Isometry3<f64>,
    reach: f64,
) -> Vec<Result<MatchedFeature, String>> {
    let place = |feature: &Feature| {
        let place = FeaturePlace::of(feature);
        FeaturePlace {
            centre: motion * place.centre,
            axis: place.axis.map(|axis| motion * axis),
            ..place
        }
    };
    let places: Vec<_> = measured.iter().map(place).collect();
    let sought = |one: &DrawnFeature| SoughtFeature {
        kind: one.shape.kind,
        id: one.id,
        place: one.has_place.then_some(one.shape.centre.value),
        size: one.size(),
    };
    let matches = match_features(
        &drawn.iter().map(sought).collect::<Vec<_>>(),
        &places,
        reach,
    );
    let each = drawn.iter().enumerate().zip(matches).map(|((at, one), found)| {
        let FeatureMatch::Found(id) = found else {
            return Err("no measured feature, or more than one, is where it should be: touch it, or name it in the column feature".to_owned());
        };
        let feature = measured.iter().find(|feature| feature.id == id).ok_or("its id is not there")?;
        paired(at, one, feature)
    });
    each.collect()
}

/// Both as a pair, if their places are comparable.
fn paired(drawn: usize, one: &DrawnFeature, feature: &Feature) -> Result<MatchedFeature, String> {
    let id = feature.id;
    if !is_aligned_by(one.shape.kind) {
        return Err(format!(
            "a {} is none: take a plane, hole, slot, pocket, boss or cylinder",
            one.shape.kind
        ));
    }
    if !one.has_place {
        return Err(
            "the drawing does not say where it is: fill in center_x_mm, center_y_mm, center_z_mm"
                .to_owned(),
        );
    }
    let axis = feature
        .axis
        .as_ref()
        .ok_or_else(|| format!("feature {id} has no axis"))?;
    let place_std = feature
        .centre
        .std
        .filter(|_| feature.fitted_to == FittedTo::Touches)
        .ok_or_else(|| format!("feature {id} has no touches behind its place: touch it"))?;
    let pair = DatumPair {
        kind: one.shape.kind,
        nominal: one.shape.centre.value,
        nominal_axis: one.shape.axis.as_ref().map(|axis| axis.value),
        measured: feature.centre.value,
        measured_axis: axis.value,
        place_std,
        axis_std: axis.std,
    };
    Ok(MatchedFeature { drawn, pair, id })
}

fn datum_of(drawn: &[DrawnFeature], name: &str) -> Result<usize, AlignmentError> {
    let found = drawn
        .iter()
        .position(|one| one.names.iter().any(|known| known == name));
    found.ok_or_else(|| {
        let all: Vec<String> = drawn.iter().map(|one| one.name().to_owned()).collect();
        AlignmentError::NoSuchDatum {
            name: name.to_owned(),
            known: first_names(&all),
        }
    })
}

fn of_datums(
    drawn: &[DrawnFeature],
    datums: &[usize],
    matched: &[Result<MatchedFeature, String>],
) -> Result<Vec<MatchedFeature>, AlignmentError> {
    let one = |&at: &usize| {
        let bad = |why: &String| AlignmentError::BadDatum {
            name: drawn[at].name().to_owned(),
            why: why.clone(),
        };
        matched[at].as_ref().cloned().map_err(bad)
    };
    datums.iter().map(one).collect()
}

fn fitted(
    drawn: &[DrawnFeature],
    used: &[MatchedFeature],
    is_by_datums: bool,
    start: &Isometry3<f64>,
) -> Result<DatumFit, AlignmentError> {
    let pairs: Vec<_> = used.iter().map(|one| one.pair).collect();
    let all = 0..pairs.len();
    let stages = if is_by_datums {
        all.map(|at| vec![at]).collect()
    } else {
        vec![all.collect()]
    };
    fit_datums(&pairs, &stages, start).map_err(|error| AlignmentError::Open {
        error,
        used: names_of(drawn, used),
    })
}

fn names_of(drawn: &[DrawnFeature], used: &[MatchedFeature]) -> String {
    if used.is_empty() {
        return "no touched feature at all".to_owned();
    }
    first_names(
        &used
            .iter()
            .map(|one| format!("{} ({})", drawn[one.drawn].name(), one.pair.kind))
            .collect::<Vec<_>>(),
    )
}

fn first_names(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST_NAMED);
    let shown = names
        .iter()
        .take(MOST_NAMED)
        .cloned()
        .collect::<Vec<_>>()
        .join(", ");
    if more == 0 {
        shown
    } else {
        format!("{shown} and {more} more")
    }
}

/// The whole measurement in the drawing frame.
fn moved(
    file: &FeatureFile,
    measured: &[Feature],
    used: &[MatchedFeature],
    fit: &DatumFit,
) -> FeatureFile {
    let mut file = file.clone();
    for record in &mut file.features {
        let std = measured
            .iter()
            .find(|feature| feature.id == record.id)
            .and_then(|feature| place_std(feature, used, fit));
        move_one(record, &fit.motion);
        if let Some(std) = std {
            record.std.insert("center_mm".to_owned(), std * 1e3);
        }
    }
    file
}

/// Standard uncertainty of a centre relative to the drawing frame, m.
fn place_std(feature: &Feature, used: &[MatchedFeature], fit: &DatumFit) -> Option<f64> {
    if let Some(at) = used.iter().position(|one| one.id == feature.id) {
        return Some(fit.place_stds[at]);
    }
    let axis = feature
        .axis
        .as_ref()
        .map_or_else(Vector3::z, |axis| axis.value);
    Some(fit.place_std(
        feature.kind,
        &(fit.motion * feature.centre.value),
        &(fit.motion * axis),
        feature.centre.std?,
    ))
}

fn move_one(record: &mut FeatureRecord, motion: &Isometry3<f64>) {
    let place =
        |mm: [f64; 3]| -> [f64; 3] { ((motion * (Point3::from(mm) * 1e-3)) * 1e3).coords.into() };
    let direction = |v: [f64; 3]| -> [f64; 3] { (motion * Vector3::from(v)).into() };
    record.center_mm = record.center_mm.map(place);
    record.axis = record.axis.map(direction);
    record.direction = record.direction.map(direction);
    record
        .points_mm
        .iter_mut()
        .for_each(|point| *point = place(*point));
}

fn record_of(
    drawn: &[DrawnFeature],
    used: &[MatchedFeature],
    fit: &DatumFit,
    method: &AlignmentMethod,
) -> AlignmentRecord {
    let turn = fit.motion.rotation.to_rotation_matrix();
    let std = fit
        .covariance
        .diagonal()
        .map(|variance| variance.max(0.0).sqrt());
    let features = used
        .iter()
        .zip(&fit.residuals)
        .map(|(one, residual)| AlignedFeatureRecord {
            name: drawn[one.drawn].name().to_owned(),
            kind: one.pair.kind.name().to_owned(),
            feature: one.id,
            residual_mm: residual * 1e3,
        });
    let squares: f64 = fit
        .residuals
        .iter()
        .map(|residual| residual * residual)
        .sum();
    AlignmentRecord {
        method: match method {
            AlignmentMethod::BestFit => "best-fit".to_owned(),
            AlignmentMethod::Datums(_) => "datums".to_owned(),
        },
        features: features.collect(),
        rotation: [0, 1, 2].map(|i| [0, 1, 2].map(|j| turn[(i, j)])),
        rotation_vector_deg: (fit.motion.rotation.scaled_axis().map(f64::to_degrees)).into(),
        translation_mm: (fit.motion.translation.vector * 1e3).into(),
        center_mm: (fit.centre * 1e3).coords.into(),
        translation_std_mm: [0, 1, 2].map(|i| std[i] * 1e3),
        rotation_std_deg: [3, 4, 5].map(|i: usize| std[i].to_degrees()),
        residual_rms_mm: (squares / fit.residuals.len().max(1) as f64).sqrt() * 1e3,
        residual_max_mm: fit.residuals.iter().copied().fold(0.0, f64::max) * 1e3,
    }
}
