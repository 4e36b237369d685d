//! What a mesh and the touches on it are made of: holes, slots, pockets, bosses, edges, corners and planes.
//!
//! The mesh is parted into planes, cylinders and cones ; what they make together is named, and measured
//! by the touches on it where there are enough, else by the mesh ([`detect`]). [`curvature`] and its [`clusters`] are the
//! paper's way to the places of features.

mod borders;
pub mod clusters;
mod cones;
mod creases;
pub mod curvature;
mod detect;
mod facets;
mod feature;
pub mod fit;
mod holes;
mod k_means;
mod measure;
mod observe;
mod primitive;
mod rays;
mod scene;
mod segment;
mod slots;
mod track;
mod walls;

pub use detect::{Detection, detect};
pub use feature::{Feature, FittedTo, Kind, Measured};
pub use k_means::{KMeans, k_means};
pub use track::Tracker;

/// debug
#[doc(hidden)]
pub fn debug_walls(mesh: &crate::mesh::TriMesh) {
    let tree = crate::mesh::FaceTree::new(mesh);
    let mut parted = scene::Parted::of(mesh, &tree);
    let mut walls = walls::Wall::all(&parted.facets, &parted.segmentation);
    cones::add_cones(&mut parted, &mut walls);
    for w in &walls {
        let o = w.at(w.middle()).coords * 1e3;
        println!(
            "wall {:?} {} d {:.3} cov {:.2} height {:.3} at ({:.2} {:.2} {:.2}) axis {:.3?} tol {:.3} area {:.1} segs {:?}",
            w.side(),
            w.is_cone(),
            w.radius() * 2e3,
            w.coverage,
            w.height() * 1e3,
            o.x,
            o.y,
            o.z,
            w.axis.as_slice(),
            parted.segment(w.segments[0]).tolerance * 1e3,
            parted.segment(w.segments[0]).area * 1e6,
            w.segments
        );
        let r = w.radius();
        if r > 0.002 && r < 0.006 && w.coverage > 0.5 {
            for (e, s) in [(0, 1.0), (1, -1.0)] {
                println!(
                    "    end {e} plane_around {:?}",
                    parted.plane_around(&w.at(w.ends[e]), &(w.axis * s), &[1.06 * r, 1.15 * r, 1.3 * r], 0.4 * r)
                );
            }
        }
    }
}
