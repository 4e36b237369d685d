//! Region of the scan for all touches: the rest gets no adjacency and no tree.

use super::{Scene, SceneError};
use touchup_geometry::mesh::{MeshRemainder, Region, TriMesh};
use touchup_method::haptic::{RefineParams, RoiSize, ScanRegion};
use touchup_method::reconstruct::PatcherParams;
use touchup_method::stylus::WrenchFrame;

/// Reach of a touch in the patch, in tip sizes: the fit of the touches reaches two, free space one
/// more.
const TIPS: f64 = 4.0;
/// Additional reach in lattice cells, for the fill-in of the surface.
const CELLS: f64 = 6.0;
/// Margin around changes, in edges: the faces around the ring around a face.
const EDGES: f64 = 4.0;

/// The touchable part of a scan, and its cut.
#[derive(Clone, Debug)]
pub struct CutScan {
    /// the touchable part with its margin; the whole scan if the scene names no region
    pub mesh: TriMesh,
    /// the cut-off part
    pub cut: RegionCut,
}

/// The part of the scan outside a scene's region.
#[derive(Clone, Debug, Default)]
pub struct RegionCut {
    /// the rest of the scan; `None` if the scene names no region
    pub outside: Option<MeshRemainder>,
    haptic: Option<ScanRegion>,
    patch: Option<Region>,
}

impl Scene {
    /// The touchable box, if the scene names one.
    pub fn region(&self) -> Option<Region> {
        let scan = self.scan.as_ref()?;
        Some(Region {
            low: scan.region_low?,
            high: scan.region_high?,
        })
    }

    /// Cuts the touchable part out of the scan, with the margin of haptic update and patch.
    ///
    /// # Errors
    /// [`SceneError::EmptyRegion`] if no face is near.
    pub fn cut(&self, scan: TriMesh) -> Result<CutScan, SceneError> {
        let Some(region) = self.region() else {
            return Ok(CutScan {
                mesh: scan,
                cut: RegionCut::default(),
            });
        };
        let mean_edge = scan.mean_edge();
        let margin = self.margin(mean_edge);
        let (mesh, outside) = scan.cut(&region.grown(margin));
        if mesh.face_count() == 0 {
            return Err(SceneError::EmptyRegion);
        }
        let haptic = Some(ScanRegion {
            region,
            margin,
            mean_edge,
        });
        Ok(CutScan {
            mesh,
            cut: RegionCut {
                outside: Some(outside),
                haptic,
                patch: Some(region),
            },
        })
    }

    /// Maximum distance from the region at which a touch in it changes anything, m.
    fn margin(&self, mean_edge: f64) -> f64 {
        // the axes of the wrench change no length
        let haptic = self.refine_params(WrenchFrame::default());
        let patch = self.patcher_params();
        let of_update = haptic.map_or(0.0, |params| {
            let roi = if let RoiSize::Radius(radius) = params.roi {
                radius
            } else {
                0.0
            };
            let furthest = params.largest_move_edges * mean_edge;
            // the paper bounds no move: its handle is at the tip
            let furthest = if furthest.is_finite() && params.largest_move_edges < f64::MAX {
                furthest
            } else {
                0.0
            };
            roi + params.tip.radius + furthest.max(params.largest_move_noises * params.scan_noise)
        });
        let of_patch = patch.map_or(0.0, |params| {
            TIPS * params.evidence.radius + params.evidence.scan_reach + CELLS * params.pitch()
        });
        of_update.max(of_patch) + EDGES * mean_edge
    }
}

impl RegionCut {
    /// Memory of the rest, bytes.
    pub fn bytes(&self) -> usize {
        self.outside.as_ref().map_or(0, MeshRemainder::bytes)
    }

    /// Settings of the haptic update restricted to the region.
    pub fn refine_params(&self, params: RefineParams) -> RefineParams {
        RefineParams {
            region: self.haptic,
            ..params
        }
    }

    /// Settings of the patch restricted to the region.
    pub fn patcher_params(&self, params: PatcherParams) -> PatcherParams {
        PatcherParams {
            region: self.patch,
            ..params
        }
    }
}
