//! Characteristics with their decisions, from drawing and measurement.

use std::collections::{BTreeMap, BTreeSet};
use std::time::SystemTime;

use chrono::{DateTime, SecondsFormat, Utc};
use nalgebra::Point3;

use super::alignment::{Alignment, aligned};
use super::drawing::{DrawnCharacteristic, PartDrawing};
use super::drawn_feature::shape_of;
use super::measured::{CharacteristicMeasurement, is_of_mesh, measurement, missing_touches};
use super::source::InspectionSource;
use super::words::first_few;
use super::{InspectionError, InspectionParams};
use touchup_features::conformity::{
    Assessment, Decision, DecisionParams, FeatureMatch, FeaturePlace, MeasuredNumber,
    SoughtFeature, ToleranceLimits, assess, match_features,
};
use touchup_features::features::InspectedQuantity;
use touchup_io::features_file::{FeatureFile, FeatureRecord};
use touchup_io::inspection_file::{CharacteristicRecord, InspectionRecord};
use touchup_io::machine::VERSION;
use touchup_io::nominal_file::NominalRecord;

/// One feature of the drawing, a balloon of the picture.
pub struct Balloon {
    /// from 1 on
    pub number: usize,
    /// kind of feature
    pub kind: String,
    /// measured place, else nominal place
    pub place_mm: Option<[f64; 3]>,
    /// `id` of the measured feature
    pub feature: Option<u32>,
    /// its characteristics, as indices into the record
    pub characteristics: Vec<usize>,
}

/// A whole inspection, as shown.
pub struct Inspection {
    /// the record of the file
    pub record: InspectionRecord,
    /// numbered places in the picture
    pub balloons: Vec<Balloon>,
    /// touches behind each characteristic: runs of numbers
    pub runs: Vec<Vec<[u32; 2]>>,
    /// quantity of each characteristic
    pub quantities: Vec<InspectedQuantity>,
}

/// Inspects the measurement against the drawing.
///
/// # Errors
/// [`InspectionError::Alignment`]
pub fn inspected(
    source: &InspectionSource,
    drawing: &PartDrawing,
    params: &InspectionParams,
) -> Result<Inspection, InspectionError> {
    let drawn = &drawing.characteristics;
    let (match_mm, align) = (&params.drawing.match_mm, &params.drawing.align);
    let by = |method| aligned(&drawing.features, &source.features, method, *match_mm);
    let alignment = align.as_ref().map(by).transpose()?;
    let file = alignment
        .as_ref()
        .map_or(&source.features, |alignment| &alignment.features);
    let groups = groups_of(drawn);
    let found = match_all(drawn, &groups, file, match_mm * 1e-3);
    let mut balloons = Vec::new();
    let mut characteristics = vec![CharacteristicRecord::default(); drawn.len()];
    let mut runs = vec![Vec::new(); drawn.len()];
    for (number, group) in (1..).zip(&groups) {
        let first = &drawn[group[0]].nominal;
        let matched = &found.features[number - 1];
        // the picture shows the mesh
        let feature = found_feature(matched, &source.features);
        for (index, &at) in (1..).zip(group) {
            let place = format!("{number}.{index}");
            let datum = found.datums[at].as_ref();
            let matched = MatchedCharacteristic::of(&drawn[at], matched, datum, file);
            let measured = matched.measured(file, align.is_some());
            characteristics[at] = matched.record(place, &measured, params);
            runs[at] = measured.runs;
        }
        balloons.push(Balloon {
            number,
            kind: first.kind.clone(),
            place_mm: feature
                .and_then(|feature| feature.center_mm)
                .or_else(|| in_mesh(first.center_mm?, &alignment)),
            feature: feature.map(|feature| feature.id),
            characteristics: group.clone(),
        });
    }
    let matched: BTreeSet<u32> = balloons
        .iter()
        .filter_map(|balloon| balloon.feature)
        .collect();
    let quantities = drawn.iter().map(|drawn| drawn.quantity).collect();
    let record = record_of(
        source,
        drawing,
        params,
        (characteristics, alignment),
        &matched,
    );
    Ok(Inspection {
        record,
        balloons,
        runs,
        quantities,
    })
}

/// A place of the drawing in the frame of the mesh, mm.
fn in_mesh(mm: [f64; 3], alignment: &Option<Alignment>) -> Option<[f64; 3]> {
    let Some(alignment) = alignment else {
        return Some(mm);
    };
    Some(
        (alignment.motion.inverse_transform_point(&point(mm)) * 1e3)
            .coords
            .into(),
    )
}

/// Characteristics by feature of the drawing, in order of their first.
fn groups_of(drawn: &[DrawnCharacteristic]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (at, one) in drawn.iter().enumerate() {
        let same =
            |group: &&mut Vec<usize>| drawn[group[0]].nominal.is_of_the_same_feature(&one.nominal);
        match groups.iter_mut().find(same) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    groups
}

struct DrawingMatches {
    /// match of each group
    features: Vec<FeatureMatch>,
    /// datum of each characteristic, if any
    datums: Vec<Option<FeatureMatch>>,
}

fn match_all(
    drawn: &[DrawnCharacteristic],
    groups: &[Vec<usize>],
    file: &FeatureFile,
    reach: f64,
) -> DrawingMatches {
    let shapes = file.features.iter().filter_map(shape_of);
    let places: Vec<_> = shapes.map(|shape| FeaturePlace::of(&shape)).collect();
    let sought: Vec<_> = groups.iter().map(|group| sought_of(drawn, group)).collect();
    let features = match_features(&sought, &places, reach);
    let datum = |one: &DrawnCharacteristic| {
        let datum = one.nominal.datum.as_ref()?;
        let place = datum.center_mm.map(point);
        let sought = SoughtFeature {
            kind: datum.kind()?,
            id: datum.feature,
            place,
            size: None,
        };
        match_features(&[sought], &places, reach).pop()
    };
    DrawingMatches {
        features,
        datums: drawn.iter().map(datum).collect(),
    }
}

fn point(mm: [f64; 3]) -> Point3<f64> {
    Point3::from(mm) * 1e-3
}

fn sought_of(drawn: &[DrawnCharacteristic], group: &[usize]) -> SoughtFeature {
    let first = &drawn[group[0]].nominal;
    let is_size = |at: &&usize| {
        matches!(
            drawn[**at].quantity,
            InspectedQuantity::Diameter | InspectedQuantity::Width
        )
    };
    let size = group
        .iter()
        .find(is_size)
        .map(|&at| drawn[at].nominal.nominal() * 1e-3);
    SoughtFeature {
        kind: first.kind().unwrap_or_default(),
        id: first.feature,
        place: first.center_mm.map(point),
        size,
    }
}

fn found_feature<'a>(matched: &FeatureMatch, file: &'a FeatureFile) -> Option<&'a FeatureRecord> {
    let FeatureMatch::Found(id) = matched else {
        return None;
    };
    file.feature(*id)
}

/// Cause of a missing measured feature.
fn why_not(
    matched: &FeatureMatch,
    kind: &str,
    nominal: &NominalRecord,
    is_aligned: bool,
) -> String {
    let place = |center: Option<[f64; 3]>| {
        center.map_or(String::new(), |[x, y, z]| {
            format!(" near ({x:.1} {y:.1} {z:.1}) mm")
        })
    };
    match matched {
        FeatureMatch::Missing if nominal.feature.is_some() => {
            format!(
                "there is no {kind} {}: see the ids in the features",
                nominal.feature.unwrap_or_default()
            )
        }
        FeatureMatch::Missing => {
            let or = if is_aligned {
                ""
            } else {
                ", or align drawing and mesh where they do not share a frame"
            };
            format!(
                "no {kind} was found{}: touch it{or}",
                place(nominal.center_mm)
            )
        }
        FeatureMatch::Ambiguous(ids) => {
            let ids = ids
                .iter()
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(" and ");
            format!("it could be {kind} {ids}: name one in the column feature")
        }
        FeatureMatch::Shared(id) => {
            format!(
                "{kind} {id} could also be another one of the drawing: name them in the column feature, or lower --match-mm"
            )
        }
        FeatureMatch::Found(_) => String::new(),
    }
}

/// A characteristic of the drawing with its features in the measurement.
struct MatchedCharacteristic<'a> {
    drawn: &'a DrawnCharacteristic,
    feature_match: &'a FeatureMatch,
    datum_match: Option<&'a FeatureMatch>,
    feature: Option<&'a FeatureRecord>,
    datum: Option<&'a FeatureRecord>,
}

impl<'a> MatchedCharacteristic<'a> {
    fn of(
        drawn: &'a DrawnCharacteristic,
        feature_match: &'a FeatureMatch,
        datum_match: Option<&'a FeatureMatch>,
        file: &'a FeatureFile,
    ) -> Self {
        Self {
            drawn,
            feature_match,
            datum_match,
            feature: found_feature(feature_match, file),
            datum: datum_match.and_then(|datum| found_feature(datum, file)),
        }
    }

    fn measured(&self, file: &FeatureFile, is_aligned: bool) -> CharacteristicMeasurement {
        let nominal = &self.drawn.nominal;
        match (self.feature, self.datum_match, self.datum) {
            (None, ..) => CharacteristicMeasurement::none(why_not(
                self.feature_match,
                &nominal.kind,
                nominal,
                is_aligned,
            )),
            (Some(_), Some(datum), None) => {
                let record = nominal.datum.clone().unwrap_or_default();
                let as_nominal = NominalRecord {
                    center_mm: record.center_mm,
                    feature: record.feature,
                    ..NominalRecord::default()
                };
                let why = why_not(datum, &record.kind, &as_nominal, is_aligned);
                CharacteristicMeasurement::none(format!("datum: {why}"))
            }
            (Some(feature), ..) => measurement(
                file,
                feature,
                nominal.kind().unwrap_or_default(),
                self.drawn.quantity,
                nominal.center_mm,
                self.datum,
            ),
        }
    }

    /// Decision on a measured number, and its reason.
    fn assessed(
        &self,
        number: Option<MeasuredNumber>,
        decision: &DecisionParams,
    ) -> (Assessment, Option<String>) {
        let (quantity, limits) = (self.drawn.quantity, self.drawn.limits);
        let facets_mm = self.drawn.facets_mm;
        let untouched = [self.feature, self.datum]
            .into_iter()
            .flatten()
            .find(|feature| is_of_mesh(feature));
        let assessed = |limits| match &number {
            Some(number) if untouched.is_none() => {
                assess(number, limits, quantity.distribution(), decision)
            }
            _ => Assessment::default(),
        };
        let of_facets = ToleranceLimits {
            lower: limits.lower.map(|lower| lower - facets_mm),
            ..limits
        };
        let (mut assessment, as_facets) = (assessed(limits), assessed(of_facets));
        let mut why = match untouched {
            Some(feature) => Some(missing_touches(feature, quantity)),
            None => assessment.reason.map(|reason| reason.to_string()),
        };
        if assessment.decision == Decision::Fail && as_facets.decision != Decision::Fail {
            (assessment.decision, assessment.rejection) =
                (Decision::Undecided, as_facets.rejection);
            why = Some(format!(
                "a part made as the facets of the CAD mesh measures up to {facets_mm:.3} mm less: take a finer mesh, or the number of the drawing"
            ));
        }
        (assessment, why)
    }

    fn record(
        &self,
        number: String,
        measured: &CharacteristicMeasurement,
        params: &InspectionParams,
    ) -> CharacteristicRecord {
        let (drawn, nominal) = (self.drawn, &self.drawn.nominal);
        let (assessment, why) = self.assessed(measured.number, &params.report.decision());
        let mut record = CharacteristicRecord {
            number,
            name: nominal.name.clone(),
            kind: nominal.kind.clone(),
            feature: self.feature.map(|feature| feature.id),
            datum: self.datum.map(|datum| datum.id),
            quantity: drawn.quantity.name().to_owned(),
            is_at_least: measured.number.is_some_and(|number| number.is_at_least),
            tolerance_from: drawn.from.clone(),
            decision: assessment.decision.name().to_owned(),
            reason: measured.why_none.clone().or(why),
            conformance_probability: assessment.conformance_probability,
            risk: assessment.risk(),
            touches: measured
                .runs
                .iter()
                .map(|[first, last]| (last - first + 1) as usize)
                .sum(),
            fitted_to: self
                .feature
                .map_or(String::new(), |feature| feature.fitted_to.clone()),
            ..CharacteristicRecord::default()
        };
        let std = measured.number.and_then(|number| number.std);
        let actual = measured.number.map(|number| number.value);
        let expanded = std.map(|std| std * params.report.coverage_factor);
        for (name, number) in [
            ("nominal", Some(nominal.nominal())),
            ("lower_limit", drawn.limits.lower),
            ("upper_limit", drawn.limits.upper),
            ("actual", actual),
            ("deviation", actual.map(|actual| actual - nominal.nominal())),
            ("standard_uncertainty", std),
            ("expanded_uncertainty", expanded),
            ("acceptance_lower", assessment.acceptance.lower),
            ("acceptance_upper", assessment.acceptance.upper),
            ("rejection_lower", assessment.rejection.lower),
            ("rejection_upper", assessment.rejection.upper),
        ] {
            record.set(name, number);
        }
        record
    }
}

/// Kinds that usually have a characteristic in a drawing.
const COUNTED: [&str; 7] = [
    "hole", "slot", "pocket", "boss", "cylinder", "notch", "sphere",
];

fn record_of(
    source: &InspectionSource,
    drawing: &PartDrawing,
    params: &InspectionParams,
    (characteristics, alignment): (Vec<CharacteristicRecord>, Option<Alignment>),
    matched: &BTreeSet<u32>,
) -> InspectionRecord {
    let unused = alignment
        .iter()
        .filter(|alignment| !alignment.unused.is_empty())
        .map(|alignment| {
            format!(
                "Not used for the alignment, as they were not found or not touched: {}.",
                first_few(&alignment.unused, ", ")
            )
        });
    let notes = source
        .notes
        .iter()
        .chain(&drawing.notes)
        .cloned()
        .chain(unused)
        .collect();
    let count = |decision: Decision| {
        characteristics
            .iter()
            .filter(|one| one.decision == decision.name())
            .count()
    };
    let counts: BTreeMap<_, _> = Decision::ALL
        .into_iter()
        .map(|decision| (decision.name().to_owned(), count(decision)))
        .collect();
    let verdict = match (count(Decision::Fail), count(Decision::Undecided)) {
        (0, 0) => Decision::Pass,
        (0, _) => Decision::Undecided,
        _ => Decision::Fail,
    };
    let counted = source
        .features
        .features
        .iter()
        .filter(|feature| COUNTED.contains(&&*feature.kind));
    let without: Vec<_> = counted
        .map(|feature| feature.id)
        .filter(|id| !matched.contains(id))
        .collect();
    let files = [drawing.file.clone()]
        .into_iter()
        .chain(source.files.iter().cloned());
    InspectionRecord {
        part: params.report.part.clone(),
        serial: params.report.serial.clone(),
        operator: params.report.operator.clone(),
        date: DateTime::<Utc>::from(SystemTime::now()).to_rfc3339_opts(SecondsFormat::Secs, true),
        program: format!("touchup {VERSION}"),
        rule: params.report.rule.name().to_owned(),
        confidence: params.report.confidence,
        coverage_factor: params.report.coverage_factor,
        verdict: verdict.name().to_owned(),
        counts,
        files: files.collect(),
        alignment: alignment.map(|alignment| alignment.record),
        characteristics,
        without_characteristic: without,
        notes,
    }
}
