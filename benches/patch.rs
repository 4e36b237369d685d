//! The patch: clipping the scan at a region, and remeshing the region, for each cell that the
//! surface passes through.

use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::{Point3, Vector3};
use touchup::mesh::{FaceTree, TriMesh, signed_distance};
use touchup::reconstruct::{
    Crossing, Cut, Edge, Lattice, LatticeRegion, NodeValues, Patch, contour,
};
use touchup::sim::wavy;

/// Pitch of the lattice, m.
const PITCH: f64 = 0.75e-3;
/// Faces of the plate: edges of 2.5 mm, as a coarse scan has, and of 0.6 mm.
const FACES: [usize; 2] = [30_000, 500_000];
/// Half the side of the square region, m.
const REACH: f64 = 20e-3;

fn main() {
    divan::main();
}

struct Case {
    scan: TriMesh,
    tree: FaceTree,
    lattice: Lattice,
    region: LatticeRegion,
    values: NodeValues,
    /// cells that the surface passes through
    surface_cells: usize,
}

impl Case {
    fn new(faces: usize) -> Self {
        let scan = wavy::wavy_plate(faces).expect("it can be counted");
        let tree = FaceTree::new(&scan);
        let lattice = Lattice {
            origin: Point3::new(0.137, -0.0931, 0.2713) * PITCH,
            pitch: PITCH,
        };
        let middle = wavy::SIDE / 2.0;
        let lo = lattice.cell_of(&Point3::new(middle - REACH, middle - REACH, -4e-3));
        let hi = lattice.cell_of(&Point3::new(middle + REACH, middle + REACH, 4e-3));
        let (mut region, mut values, mut surface_cells) =
            (LatticeRegion::default(), NodeValues::default(), 0);
        let cells = (lo[0]..hi[0])
            .flat_map(|x| (lo[1]..hi[1]).flat_map(move |y| (lo[2]..hi[2]).map(move |z| [x, y, z])));
        for cell in cells {
            let centre = lattice.position(cell) + Vector3::repeat(PITCH / 2.0);
            // a shell of two cells, since the field is known near the surface only
            if tree.closest(&scan, &centre, 1.5 * PITCH).is_none() {
                continue;
            }
            region.insert(cell, ());
            let mut outside = 0;
            for corner in 0..8 {
                let node = std::array::from_fn(|i| cell[i] + (corner >> i & 1));
                values.insert_with(node, || {
                    signed_distance(&scan, &tree, &lattice.position(node), 1.0).unwrap_or(1.0)
                });
                outside += usize::from(values.get(&node).is_some_and(|f| *f >= 0.0));
            }
            surface_cells += usize::from(outside % 8 != 0);
        }
        Self {
            scan,
            tree,
            lattice,
            region,
            values,
            surface_cells,
        }
    }

    fn cut(&self) -> Cut {
        Cut::new(&self.lattice, &self.region, &self.scan, &self.tree)
    }

    fn contour(&self, cut: &Cut) -> Patch {
        let crossing = |edge: &Edge| {
            let [a, b] =
                [edge.node, edge.end()].map(|node| self.values.get(&node).copied().unwrap_or(1.0));
            let mut point = self.lattice.position(edge.node);
            point[edge.axis as usize] += PITCH * a / (a - b);
            Crossing {
                point,
                normal: Vector3::z(),
            }
        };
        contour(&self.lattice, &self.region, &self.values, cut, crossing)
    }
}

/// Clips the scan at the rim of the region.
#[divan::bench(args = FACES)]
fn cut(bencher: Bencher, faces: usize) {
    let case = Case::new(faces);
    assert!(!case.cut().patch.removed.is_empty());
    bencher
        .counter(ItemsCount::new(case.surface_cells))
        .bench(|| case.cut());
}

/// Meshes the region.
#[divan::bench(args = FACES)]
fn mesh(bencher: Bencher, faces: usize) {
    let case = Case::new(faces);
    let cut = case.cut();
    let patch = case.contour(&cut);
    assert!(patch.open.is_empty() && patch.faces.len() > case.surface_cells);
    bencher
        .counter(ItemsCount::new(case.surface_cells))
        .bench(|| case.contour(&cut));
}
