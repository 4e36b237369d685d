//! Faces from the loops of regions.

use std::f64::consts::PI;

use super::crossings::are_one;
use super::polyline::length_of;
use super::surfaces::PartSurface;
use touchup_geometry::brep::{
    BrepFace, BrepParts, FaceLoop, OrientedEdge, SurfaceShape, area_and_turn,
};

/// The face of a region with its loops, the outer one of a plane first, without those along an edge
/// and back; a cone around its apex ends there, and a whole sphere has a pole.
pub(super) fn face_of(
    parts: &mut BrepParts,
    surface: &PartSurface,
    number: usize,
    loops: Vec<Vec<OrientedEdge>>,
) -> BrepFace {
    let own = surface.surface;
    let measure = |edges: Vec<OrientedEdge>| {
        let points: Vec<_> = edges.iter().flat_map(|one| parts.points(one)).collect();
        let (area, turn) = area_and_turn(&own, &points);
        let is_there_and_back = matches!(&edges[..], [one, other] if are_one(parts, [one, other]));
        let is_sliver = is_there_and_back || area.abs() < surface.tolerance * length_of(&points);
        (!is_sliver || turn.abs() > PI).then_some(((area, turn), edges))
    };
    let mut measured: Vec<_> = loops.into_iter().filter_map(measure).collect();
    if own.shape == SurfaceShape::Plane {
        measured.sort_by(|((a, _), _), ((b, _), _)| b.abs().total_cmp(&a.abs()));
    }
    let turn: f64 = measured.iter().map(|((_, turn), _)| turn).sum();
    let loops = measured
        .into_iter()
        .map(|(_, edges)| FaceLoop::Edges(edges));
    let mut loops: Vec<_> = loops.collect();
    let place = own.placement;
    let (kind, apex) = match own.shape {
        SurfaceShape::Plane => ("plane", None),
        SurfaceShape::Cone { radius, half_angle } => {
            let apex = place.origin - place.axis * (radius / half_angle.tan());
            ("cone", Some(apex).filter(|_| turn.abs() > PI))
        }
        SurfaceShape::Sphere { radius } => {
            let pole = place.origin + place.axis * radius;
            ("sphere", Some(pole).filter(|_| loops.is_empty()))
        }
        SurfaceShape::Cylinder { .. } => ("cylinder", None),
    };
    if let Some(apex) = apex {
        loops.push(FaceLoop::Vertex(parts.vertex(apex)));
    }
    let support = if surface.is_touched {
        "touched"
    } else {
        "scan"
    };
    BrepFace {
        is_touched: surface.is_touched,
        uncertainties: surface.uncertainties.clone(),
        ..BrepFace::new(
            &format!("{kind} {number} ({support})"),
            own,
            surface.is_outward,
            loops,
        )
    }
}
