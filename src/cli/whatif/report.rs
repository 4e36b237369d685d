//! Differences of two results, in numbers and in words.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde_json::Value;

use super::super::{counted, reported};
use touchup_features::compare::{Displacement, moved_count};
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_session::sweep::{COVERAGE as K, FeatureChange, JobResult, NumberChange, WhatIf};

/// Output of `--json`.
#[derive(Debug, Serialize)]
pub(super) struct WhatIfReport {
    /// Names of A and B, as on the command line.
    pub a: String,
    pub b: String,
    /// Differing keys of the scene, by path, with both values; `null`: missing.
    pub keys: BTreeMap<String, [Value; 2]>,
    /// Number of standard deviations in ±.
    pub k: f64,
    /// Vertices of the mesh of A.
    pub vertices_a: MovedVertices,
    /// Vertices of the mesh of B; `None` if both have the same vertices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices_b: Option<MovedVertices>,
    /// Number of features with a moved number, or in one result alone.
    pub features_moved: usize,
    /// All features.
    pub features: Vec<FeatureChange>,
}

reported! {
    /// Vertices of one mesh that moved by more than their ±.
    pub(super) struct MovedVertices, fn of(mesh: &TriMesh, displaced: &[Displacement]) {
        pub vertices: usize = vertices_of(mesh).count(),
        pub moved: usize = moved_count(mesh, displaced, K),
        /// Whether a standard deviation is known; if not, any displacement counts.
        pub is_sigma_known: bool = displaced.iter().any(|one| one.sigma.is_some()),
        /// Largest displacement: positive outwards.
        pub farthest_mm: Option<f64> = farthest(mesh, displaced).map(|(_, one)| one.distance * 1e3),
        /// ± of the largest displacement.
        pub farthest_plus_minus_mm: Option<f64> = farthest(mesh, displaced).map(|(_, one)| one.plus_minus(K) * 1e3),
        /// Position of the largest displacement.
        pub farthest_at_mm: Option<[f64; 3]> =
            farthest(mesh, displaced).map(|(at, _)| (mesh.position(at).coords * 1e3).into()),
    }
}

/// Existing vertices of a mesh.
pub(super) fn vertices_of(mesh: &TriMesh) -> impl Iterator<Item = VertexId> {
    (0..mesh.vertex_slots() as u32)
        .map(VertexId)
        .filter(|at| mesh.has_vertex(*at))
}

fn farthest(mesh: &TriMesh, displaced: &[Displacement]) -> Option<(VertexId, Displacement)> {
    let moved = vertices_of(mesh)
        .map(|at| (at, displaced[at.0 as usize]))
        .filter(|(_, one)| one.is_moved(K));
    moved.max_by(|(_, one), (_, other)| one.distance.abs().total_cmp(&other.distance.abs()))
}

impl WhatIfReport {
    pub fn of([a, b]: [&JobResult; 2], names: [&str; 2], found: &WhatIf) -> Self {
        Self {
            a: names[0].to_owned(),
            b: names[1].to_owned(),
            keys: found.keys.clone(),
            k: K,
            vertices_a: MovedVertices::of(&a.mesh, &found.of_a),
            vertices_b: found
                .of_b
                .as_ref()
                .map(|of_b| MovedVertices::of(&b.mesh, of_b)),
            features_moved: found.features.iter().filter(|one| one.is_moved()).count(),
            features: found.features.clone(),
        }
    }

    /// Differing keys, one in a line.
    pub fn differences(&self) -> Vec<String> {
        let shown = |value: &Value| match value {
            Value::Null => "not there".to_owned(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        self.keys
            .iter()
            .map(|(key, [a, b])| format!("{key}: {} → {}", shown(a), shown(b)))
            .collect()
    }
}

/// Output of `touchup whatif --json` for two results.
///
/// - `names`: names of the results.
pub fn what_if_json(results: [&JobResult; 2], names: [&str; 2], found: &WhatIf) -> Value {
    serde_json::to_value(WhatIfReport::of(results, names, found)).unwrap_or_default()
}

/// Maximum number of listed features.
const MOST_NAMED: usize = 20;

impl fmt::Display for WhatIfReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.keys.is_empty() {
            write!(f, "A and B are of the same inputs")?;
        }
        write!(f, "{}", self.differences().join("\n"))?;
        let of_mesh = [
            ("A", Some(&self.vertices_a)),
            ("B", self.vertices_b.as_ref()),
        ];
        for (name, vertices) in of_mesh {
            let Some(vertices) = vertices else { continue };
            let name = if self.vertices_b.is_some() {
                name
            } else {
                "both"
            };
            write!(f, "\n{}", vertices.in_words(name))?;
        }
        let all = counted(self.features.len(), "feature", "features");
        write!(
            f,
            "\nfeatures: {} of {all} moved by more than their ± (k = {}), or are in one alone",
            self.features_moved, self.k
        )?;
        for feature in self
            .features
            .iter()
            .filter(|one| one.is_moved())
            .take(MOST_NAMED)
        {
            write!(f, "\n  {}", in_words(feature))?;
        }
        match self.features_moved.saturating_sub(MOST_NAMED) {
            0 => Ok(()),
            more => write!(f, "\n  and {more} more"),
        }
    }
}

impl MovedVertices {
    fn in_words(&self, name: &str) -> String {
        let Self {
            vertices,
            moved,
            farthest_mm,
            farthest_plus_minus_mm,
            ..
        } = self;
        let by = if self.is_sigma_known {
            format!("by more than their ± (k = {K})")
        } else {
            "(no ± is known)".to_owned()
        };
        let most = farthest_mm.zip(*farthest_plus_minus_mm);
        let most = most.map_or(String::new(), |(mm, known)| {
            format!(", the farthest by {mm:+.3} mm (± {known:.3})")
        });
        format!("vertices of {name}: {moved} of {vertices} moved {by}{most}")
    }
}

/// Feature with its moved numbers.
fn in_words(feature: &FeatureChange) -> String {
    let FeatureChange {
        kind,
        id_a,
        id_b,
        center_mm,
        numbers,
    } = feature;
    let place = center_mm.map_or(String::new(), |[x, y, z]| {
        format!(" at ({x:.1}, {y:.1}, {z:.1}) mm")
    });
    match (id_a, id_b) {
        (Some(id), None) => format!("{kind} {id}{place}: found by A alone"),
        (None, Some(id)) => format!("{kind} {id}{place}: found by B alone"),
        (id, _) => {
            let moved: Vec<_> = numbers
                .iter()
                .filter(|number| number.moved)
                .map(number_in_words)
                .collect();
            format!(
                "{kind} {}{place}: {}",
                id.unwrap_or_default(),
                moved.join(", ")
            )
        }
    }
}

fn number_in_words(number: &NumberChange) -> String {
    let NumberChange {
        name,
        a,
        b,
        change,
        plus_minus,
        ..
    } = number;
    let known = plus_minus.map_or("± unknown".to_owned(), |known| format!("± {known:.3}"));
    match a.zip(*b) {
        Some((a, b)) => format!("{name} {a:.3} → {b:.3} ({change:+.3}, {known})"),
        None => format!("{name} apart by {change:.3} ({known})"),
    }
}
