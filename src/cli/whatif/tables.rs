//! Differences of two results, as tables and as a mesh.

use std::path::Path;

use serde_json::Value;

use super::super::CliError;
use super::super::common::pictures::write_coloured;
use super::page::colour_at;
use super::report::vertices_of;
use touchup_features::compare::{Displacement, Rgb};
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::{MeshUnit, VertexColumn};
use touchup_io::result_table::ResultTable;
use touchup_session::sweep::{COVERAGE as K, JobResult, WhatIf};

/// Table with a row for each vertex.
pub(super) fn vertices_table([a, b]: [&JobResult; 2], found: &WhatIf) -> ResultTable {
    let mut table = ResultTable::default();
    let name = if found.of_b.is_some() { "a" } else { "both" };
    add_vertices(&mut table, name, &a.mesh, &found.of_a);
    if let Some(of_b) = &found.of_b {
        add_vertices(&mut table, "b", &b.mesh, of_b);
    }
    table
}

fn add_vertices(table: &mut ResultTable, name: &str, mesh: &TriMesh, displaced: &[Displacement]) {
    for (number, at) in vertices_of(mesh).enumerate() {
        let (one, place) = (&displaced[at.0 as usize], mesh.position(at) * 1e3);
        let number_of = |mm: f64| Value::from(mm);
        let row = [
            ("mesh", Value::from(name)),
            ("vertex", number.into()),
            ("x_mm", number_of(place.x)),
            ("y_mm", number_of(place.y)),
            ("z_mm", number_of(place.z)),
            ("displacement_mm", number_of(one.distance * 1e3)),
            (
                "plus_minus_mm",
                one.sigma
                    .map_or(Value::Null, |_| number_of(one.plus_minus(K) * 1e3)),
            ),
            ("moved", one.is_moved(K).into()),
        ];
        table.add_json(&row);
    }
}

/// Table with a row for each number of each common feature, and one for each unmatched feature.
pub(super) fn features_table(found: &WhatIf) -> ResultTable {
    let mut table = ResultTable::default();
    for feature in &found.features {
        let of_feature = [
            ("kind", Value::from(feature.kind.clone())),
            ("id_a", feature.id_a.into()),
            ("id_b", feature.id_b.into()),
            (
                "center_mm",
                feature
                    .center_mm
                    .map_or(Value::Null, |center| center.to_vec().into()),
            ),
        ];
        if feature.numbers.is_empty() {
            let moved = [("moved", feature.is_moved().into())];
            table.add_json(&[&of_feature[..], &moved].concat());
        }
        for number in &feature.numbers {
            let of_number = [
                ("number", Value::from(number.name)),
                ("a", number.a.into()),
                ("b", number.b.into()),
                ("change", number.change.into()),
                ("plus_minus", number.plus_minus.into()),
                ("moved", number.moved.into()),
            ];
            table.add_json(&[&of_feature[..], &of_number].concat());
        }
    }
    table
}

/// Writes the mesh of B in the colours of the page, with columns.
pub(super) fn write_moved_mesh(path: &Path, b: &JobResult, found: &WhatIf) -> Result<(), CliError> {
    let displaced = found.of_b.as_ref().unwrap_or(&found.of_a);
    let colours: Vec<Rgb> = displaced.iter().map(colour_at).collect();
    let column = |name, of: fn(&Displacement) -> f64| {
        let values: Vec<f32> = displaced.iter().map(|one| of(one) as f32).collect();
        VertexColumn {
            name,
            values: values.into(),
        }
    };
    let columns = [
        column("displacement_mm", |one| one.distance * 1e3),
        column("plus_minus_mm", |one| one.plus_minus(K) * 1e3),
        column("moved", |one| if one.is_moved(K) { 1.0 } else { 0.0 }),
    ];
    write_coloured(path, &b.mesh, MeshUnit::Millimetre, &colours, columns)
}
