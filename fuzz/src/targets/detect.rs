//! Features of a small mesh of any vertices: numbers without NaN.

use crate::{closed_box, vector};
use arbitrary::{Result, Unstructured};
use nalgebra::Point3;
use touchup_geometry::mesh::repair;
use touchup_session::session::found;

fn detect(bytes: &mut Unstructured) -> Result<()> {
    let mut positions = closed_box([8e-3, 5e-3, 3e-3], 1).positions().to_vec();
    let mut faces: Vec<[u32; 3]> = closed_box([8e-3, 5e-3, 3e-3], 1)
        .faces()
        .map(|(_, f)| f.map(|v| v.0))
        .collect();
    for _ in 0..bytes.int_in_range(0..=24)? {
        let at = bytes.choose_index(positions.len())?;
        match bytes.arbitrary::<u8>()? % 4 {
            0 => positions[at] += vector(bytes, 3e-3)?,
            1 => positions.push(Point3::from(vector(bytes, 8e-3)?)),
            2 => drop(faces.swap_remove(bytes.choose_index(faces.len())?)),
            _ => {
                let mut corner = || Ok(bytes.choose_index(positions.len())? as u32);
                faces.push([corner()?, corner()?, corner()?]);
            }
        }
    }
    let Ok((mesh, _)) = repair(positions, faces) else {
        return Ok(());
    };
    let (detection, _) = found(&mesh, &[]);
    let number = format!("{detection:?}");
    assert!(!number.contains("NaN"), "{number}");
    Ok(())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = detect(&mut Unstructured::new(data));
}
