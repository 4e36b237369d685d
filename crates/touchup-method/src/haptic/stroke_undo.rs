//! Stroke undo: the state before each stroke, for reversing the haptic update.

use nalgebra::Point3;

use crate::reconstruct::History;
use crate::stylus::STROKE_PAUSE_NS;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// Maximum number of positions and normals: some 60 MB.
const MOST_KEPT: usize = 1_000_000;

/// Positions of vertices, and measured normals of faces, before each stroke.
#[derive(Clone, Debug)]
pub(super) struct StrokeUndo {
    positions: History<u32, Point3<f64>>,
    evidence: History<u32, [f32; 3]>,
    last_contact_ns: Option<i64>,
}

impl Default for StrokeUndo {
    fn default() -> Self {
        Self {
            positions: History::new(MOST_KEPT),
            evidence: History::new(MOST_KEPT),
            last_contact_ns: None,
        }
    }
}

impl StrokeUndo {
    /// Begins a stroke if the contact at `stamp_ns` follows a pause.
    pub(crate) fn touch(&mut self, stamp_ns: i64) {
        if self
            .last_contact_ns
            .is_none_or(|last| stamp_ns.saturating_sub(last) > STROKE_PAUSE_NS)
        {
            self.positions.begin();
            self.evidence.begin();
        }
        self.last_contact_ns = Some(stamp_ns);
    }

    /// Keeps the positions of vertices before they move.
    pub(crate) fn note_positions(&mut self, vertices: &[VertexId], mesh: &TriMesh) {
        for &vertex in vertices {
            self.positions.note(vertex.0, || mesh.position(vertex));
        }
    }

    /// Keeps the known normal of a face before a new measurement.
    pub(crate) fn note_evidence(&mut self, face: FaceId, before: [f32; 3]) {
        self.evidence.note(face.0, || before);
    }

    /// Undoes the last stroke, or redoes the last undone one, by exchanging its state with the
    /// current one; returns the vertices that moved, `None` without a stroke.
    pub(crate) fn change(
        &mut self,
        is_undo: bool,
        mesh: &mut TriMesh,
        evidence: &mut [[f32; 3]],
    ) -> Option<Vec<VertexId>> {
        self.last_contact_ns = None;
        let mut moved = Vec::new();
        let move_vertex = |vertex, position: &mut Point3<f64>| {
            let vertex = VertexId(vertex);
            let here = mesh.position(vertex);
            mesh.set_position(vertex, std::mem::replace(position, here));
            moved.push(vertex);
        };
        let turn_face =
            |face: u32, normal: &mut [f32; 3]| std::mem::swap(&mut evidence[face as usize], normal);
        let has_changed = if is_undo {
            !self.evidence.is_empty()
                && self.positions.undo(move_vertex)
                && self.evidence.undo(turn_face)
        } else {
            self.positions.redo(move_vertex) && self.evidence.redo(turn_face)
        };
        has_changed.then_some(moved)
    }
}
