//! Decision goals of the flags, from a drawing.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::report::kind_of;
use crate::cli::{CliError, require};
use touchup_features::conformity::{
    DecisionParams, FeatureMatch, FeaturePlace, SoughtFeature, ToleranceLimits, match_features,
};
use touchup_features::features::{FeatureKind, InspectedQuantity};
use touchup_io::nominal_file::{NominalRecord, NominalTolerance, read_nominal};
use touchup_probing::execute::{Flag, StaticWorld, World};
use touchup_probing::plan::{DecisionGoal, SoughtCharacteristic};

/// Search radius for the surface at a flag, m.
const NEAR: f64 = 20e-3;

/// Reads nominal values and finds the characteristics of each flag: by its number, or by its kind,
/// with the centre within the flag's radius across the scan's normal there.
///
/// - `world`: the scan.
pub(in crate::cli) fn goals_of(
    path: &Path,
    flags: &[Flag],
    world: &StaticWorld,
    params: DecisionParams,
) -> Result<BTreeMap<u32, DecisionGoal>, CliError> {
    let records = read_nominal(path)?;
    let wrong =
        |why: String| CliError::new(("nominal", 3), format!("{}: {why}", path.display()), None);
    let mut groups: Vec<Vec<&NominalRecord>> = Vec::new();
    for record in &records {
        match groups
            .iter_mut()
            .find(|group| group[0].is_of_the_same_feature(record))
        {
            Some(group) => group.push(record),
            None => groups.push(vec![record]),
        }
    }
    let mut goals = BTreeMap::new();
    for flag in flags {
        let kind = kind_of(flag);
        require(
            flag.kind.is_some_and(|kind| kind != FeatureKind::Corner),
            format_args!(
                "feature {}: nothing of {kind} can be decided: --until decided is for other kinds",
                flag.id
            ),
        )?;
        let of_flag: Vec<_> = groups
            .iter()
            .filter(|group| is_of(group[0], flag, world))
            .collect();
        let group = match of_flag[..] {
            [group] => group,
            [] => {
                let [x, y, z]: [f64; 3] = (flag.place * 1e3).coords.into();
                return Err(wrong(format!(
                    "it has no characteristic of a {kind} within {:.1} mm of feature {} ({x:.1} {y:.1} {z:.1}): add one, or flag the \
                     feature nearer to its nominal centre",
                    flag.radius * 1e3,
                    flag.id
                )));
            }
            [first, second, ..] => {
                return Err(wrong(format!(
                    "feature {} could be that of {} or of {}: flag it nearer, or name it in the column feature",
                    flag.id, first[0].name, second[0].name
                )));
            }
        };
        goals.insert(
            flag.id,
            DecisionGoal {
                characteristics: sought(group).map_err(wrong)?,
                params,
            },
        );
    }
    Ok(goals)
}

fn is_of(record: &NominalRecord, flag: &Flag, world: &StaticWorld) -> bool {
    let Some(kind) = flag.kind else { return false };
    // the normal of the surface is the axis of all but an edge
    let normal = world
        .closest_face(&flag.place, NEAR)
        .map(|hit| Vector3::from(world.mesh().normal(hit.face)));
    let axis = normal.filter(|_| kind != FeatureKind::Edge);
    let place = FeaturePlace {
        id: flag.id,
        kind,
        centre: flag.place,
        axis,
        size: None,
    };
    let centre = record.center_mm.map(|mm| Point3::from(mm) * 1e-3);
    let sought = SoughtFeature {
        kind: record.kind().unwrap_or_default(),
        id: record.feature,
        place: centre,
        size: None,
    };
    match_features(&[sought], &[place], flag.radius) == [FeatureMatch::Found(flag.id)]
}

/// Characteristics of a group, in m.
fn sought(group: &[&NominalRecord]) -> Result<Vec<SoughtCharacteristic>, String> {
    let is_decided = |record: &&&NominalRecord| {
        record
            .kind()
            .zip(record.quantity())
            .is_some_and(|(kind, quantity)| DecisionGoal::decides(kind, quantity))
    };
    let others: Vec<_> = group.iter().filter(|record| !is_decided(record)).collect();
    if !others.is_empty() {
        let named = others
            .iter()
            .map(|record| format!("{} ({})", record.name, record.quantity))
            .collect::<Vec<_>>();
        let known = InspectedQuantity::ALL.into_iter().filter(|quantity| {
            group[0]
                .kind()
                .is_some_and(|kind| DecisionGoal::decides(kind, *quantity))
        });
        return Err(format!(
            "touches cannot be planned until {} is decided, but for {} of a {}: leave it out of this file, and let touchup inspect decide it",
            named.join(", "),
            known
                .map(InspectedQuantity::name)
                .collect::<Vec<_>>()
                .join(", "),
            group[0].kind
        ));
    }
    let of = |record: &&NominalRecord| {
        let NominalTolerance::Limits(limits) = record.tolerance() else {
            return Err(format!(
                "{} has no tolerance: fill in tolerance_mm or limit deviations",
                record.name
            ));
        };
        let metres = |limit: Option<f64>| limit.map(|mm| mm / 1e3);
        Ok(SoughtCharacteristic {
            name: record.name.clone(),
            quantity: record.quantity().unwrap_or(InspectedQuantity::Diameter),
            limits: ToleranceLimits {
                lower: metres(limits.lower),
                upper: metres(limits.upper),
            },
            nominal: record.center_mm.map(|mm| Point3::from(mm) * 1e-3),
        })
    };
    group.iter().map(of).collect()
}
