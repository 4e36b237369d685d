//! A scene in which only a region of the scan is ever touched: the rest gets no adjacency and no
//! tree.

use super::{Scene, SceneError};
use touchup_core::haptic::{RefineParams, RoiSize, ScanRegion};
use touchup_core::mesh::{Outside, Region, TriMesh};
use touchup_core::reconstruct::PatcherParams;
use touchup_core::stylus::WrenchFrame;

/// A touch changes the patch within so many sizes of the tip: the fit of the touches reaches two,
/// free space another one …
const TIPS: f64 = 4.0;
/// … and so many cells of its lattice more, in which the surface is filled in.
const CELLS: f64 = 6.0;
/// Around what changes so many edges are needed: the faces around the ring around a face.
const EDGES: f64 = 4.0;

/// The scan as it is worked on.
#[derive(Clone, Debug)]
pub struct CutScan {
    /// what can be touched, and what that needs around it; the scan itself where the scene names no
    /// region
    pub mesh: TriMesh,
    /// what was cut off
    pub cut: RegionCut,
}

/// What a scene's region leaves out.
#[derive(Clone, Debug, Default)]
pub struct RegionCut {
    /// the rest of the scan; `None` where the scene names no region
    pub outside: Option<Outside>,
    haptic: Option<ScanRegion>,
    patch: Option<Region>,
}

impl Scene {
    /// The box that is touched, where the scene names one.
    pub fn region(&self) -> Option<Region> {
        let scan = self.scan.as_ref()?;
        Some(Region {
            low: scan.region_low?,
            high: scan.region_high?,
        })
    }

    /// Takes out of the scan what is touched, with what the haptic update and the patch need around
    /// it.
    ///
    /// # Errors
    /// [`SceneError::EmptyRegion`] where no face is near.
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

    /// How far around the region a touch in it can change anything, m.
    fn margin(&self, mean_edge: f64) -> f64 {
        // which axes the wrench has changes no length
        let haptic = self.refine_params(WrenchFrame::default());
        let patch = self.patcher_params();
        let of_update = haptic.map_or(0.0, |params| {
            let roi = if let RoiSize::Radius(radius) = params.roi {
                radius
            } else {
                0.0
            };
            let furthest = params.largest_move_edges * mean_edge;
            // the paper bounds no move: its handle is where the tip is
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
        self.outside.as_ref().map_or(0, Outside::bytes)
    }

    /// Settings that keep to the region.
    pub fn refine_params(&self, params: RefineParams) -> RefineParams {
        RefineParams {
            region: self.haptic,
            ..params
        }
    }

    /// Settings that keep to the region.
    pub fn patcher_params(&self, params: PatcherParams) -> PatcherParams {
        PatcherParams {
            region: self.patch,
            ..params
        }
    }
}
