//! Boundary representations as STEP files (ISO 10303-21), in mm and rad, for CAD programs.
//!
//! The schema is AP242, the successor of AP203 and AP214: its geometry is theirs, so OpenCascade
//! and other kernels read it alike, and it alone has properties of single faces. Each closed shell
//! is a solid, open shells are a surface model. Faces have a name, a colour for touched or scanned,
//! and their standard uncertainties as user-defined attributes.

mod instances;
mod product;
mod properties;
mod shape;

use std::io::Write;
use std::path::Path;

use instances::{Instances, string};
use touchup_geometry::brep::Brep;

use super::file_error::{FileError, write_file};

/// Identification of the part in a STEP file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepProduct {
    /// name of the part
    pub name: String,
    /// date and time by ISO 8601; without it the same boundary gives the same bytes
    pub time_stamp: Option<String>,
}

/// Writes a boundary, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_step(path: &Path, brep: &Brep, product: &StepProduct) -> Result<(), FileError> {
    let text = document(brep, product);
    write_file(path, |out| out.write_all(text.as_bytes()))
}

fn document(brep: &Brep, product: &StepProduct) -> String {
    let mut data = Instances::default();
    let shape = shape::add_shape(&mut data, brep);
    let ids = product::add_product(&mut data, &product.name, &shape, brep.tolerance());
    let faces = brep.parts().faces.iter().zip(shape.faces);
    let faces: Vec<_> = faces.collect();
    properties::add_properties(&mut data, &ids, &faces);
    properties::add_colours(&mut data, &ids, &faces);
    let time_stamp = product
        .time_stamp
        .as_deref()
        .unwrap_or("1970-01-01T00:00:00");
    let version = concat!("touchup ", env!("CARGO_PKG_VERSION"));
    format!(
        "ISO-10303-21;\n\
         HEADER;\n\
         FILE_DESCRIPTION(('boundary representation of a touched scan'),'2;1');\n\
         FILE_NAME({name},{time_stamp},(''),(''),'{version}','{version}','');\n\
         FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF {{ 1 0 10303 442 1 1 4 }}'));\n\
         ENDSEC;\n\
         DATA;\n\
         {data}ENDSEC;\n\
         END-ISO-10303-21;\n",
        name = string(&product.name),
        time_stamp = string(time_stamp),
        data = data.text,
    )
}
