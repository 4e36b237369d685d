//! Scans the demo's plate badly and prints how bad the scan is.
//! With a file name it writes the scan there as OBJ, in mm.

use std::io::Write;

use touchup::mesh::TriMesh;
use touchup::sim::{Plate, ScannerParams, measure_badness, scan};

fn main() -> anyhow::Result<()> {
    let plate = Plate::default();
    let mesh = scan(&plate, &ScannerParams::default())?;
    println!("{:#?}", measure_badness(&mesh, &plate, |_| true));
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, obj(&mesh)?)?;
    }
    Ok(())
}

/// The mesh as OBJ, in mm.
fn obj(mesh: &TriMesh) -> anyhow::Result<Vec<u8>> {
    let mut text = Vec::new();
    for p in mesh.positions() {
        writeln!(text, "v {} {} {}", p.x * 1e3, p.y * 1e3, p.z * 1e3)?;
    }
    for (_, corners) in mesh.faces() {
        let [a, b, c] = corners.map(|v| v.0 + 1);
        writeln!(text, "f {a} {b} {c}")?;
    }
    Ok(text)
}
