//! Sound boundaries, or the faces at fault.

use nalgebra::Point3;

use super::crossings::{LEAST_TOLERANCE, crossing, worst};
use touchup_geometry::brep::{Brep, BrepError, BrepParts, FaceLoop};

/// Tolerance in the largest distance between elements that meet: roundings.
const ROOM: f64 = 1.01;

/// A face that is not sound.
pub(super) struct FaceFault {
    /// number of its region
    pub region: usize,
    /// place of the fault, m; `None`: all of it
    pub place: Option<Point3<f64>>,
}

/// The boundary of the parts, a face for each region, or the faces at fault.
pub(super) fn sound(parts: BrepParts) -> Result<Brep, Vec<FaceFault>> {
    let parts = used(parts);
    let faces = parts.faces.iter();
    let crossed = faces.clone().enumerate().filter_map(|(region, face)| {
        let place = Some(crossing(&parts, face)?);
        Some(FaceFault { region, place })
    });
    let crossed: Vec<FaceFault> = crossed.collect();
    if !crossed.is_empty() {
        return Err(crossed);
    }
    let off = faces.flat_map(|face| {
        let edges = face.edges().map(|one| &parts.edges[one.edge]);
        edges.map(|edge| worst(&parts, edge, &face.surface))
    });
    let tolerance = ROOM * off.fold(LEAST_TOLERANCE, f64::max);
    Brep::new(parts.clone(), tolerance).map_err(|error| faces_at_fault(&parts, &error))
}

/// Without edges and vertices that no face uses.
fn used(parts: BrepParts) -> BrepParts {
    let mut is_edge = vec![false; parts.edges.len()];
    let mut is_vertex = vec![false; parts.vertices.len()];
    for face_loop in parts.faces.iter().flat_map(|face| &face.loops) {
        match face_loop {
            FaceLoop::Vertex(vertex) => is_vertex[*vertex] = true,
            FaceLoop::Edges(edges) => edges.iter().for_each(|one| is_edge[one.edge] = true),
        }
    }
    for (edge, _) in parts.edges.iter().zip(&is_edge).filter(|(_, is)| **is) {
        (is_vertex[edge.start], is_vertex[edge.end]) = (true, true);
    }
    let number = |is_used: &[bool]| {
        let mut count = 0;
        let next = |&is: &bool| {
            count += usize::from(is);
            count.max(1) - 1
        };
        is_used.iter().map(next).collect::<Vec<_>>()
    };
    let (edge_of, vertex_of) = (number(&is_edge), number(&is_vertex));
    let mut kept = BrepParts::default();
    let vertices = parts.vertices.into_iter().zip(&is_vertex);
    kept.vertices = vertices.filter(|(_, is)| **is).map(|(p, _)| p).collect();
    for (mut edge, _) in parts.edges.into_iter().zip(&is_edge).filter(|(_, is)| **is) {
        (edge.start, edge.end) = (vertex_of[edge.start], vertex_of[edge.end]);
        kept.edges.push(edge);
    }
    kept.faces = parts.faces;
    for face_loop in kept.faces.iter_mut().flat_map(|face| &mut face.loops) {
        match face_loop {
            FaceLoop::Vertex(vertex) => *vertex = vertex_of[*vertex],
            FaceLoop::Edges(edges) => edges
                .iter_mut()
                .for_each(|one| one.edge = edge_of[one.edge]),
        }
    }
    kept
}

/// The faces that a fault is about: all of them if no one is.
fn faces_at_fault(parts: &BrepParts, error: &BrepError) -> Vec<FaceFault> {
    let of_edge = |edge: usize| {
        let mut faces = parts.faces.iter();
        faces.position(|face| face.edges().any(|one| one.edge == edge))
    };
    let known = match error {
        BrepError::OpenLoop { face, .. }
        | BrepError::Unbounded { face, .. }
        | BrepError::BoundOffSurface { face, .. } => Some(*face),
        BrepError::VertexOffCurve { edge, .. }
        | BrepError::EmptyLine { edge }
        | BrepError::WrongUses { edge, .. }
        | BrepError::SameDirection { edge } => of_edge(*edge),
        BrepError::Empty | BrepError::BadNumber { .. } | BrepError::Missing { .. } => None,
    };
    let faces = known.map_or(0..parts.faces.len(), |face| face..face + 1);
    let fault = |region| FaceFault {
        region,
        place: None,
    };
    faces.map(fault).collect()
}
