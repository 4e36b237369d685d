//! Support, standard uncertainties and colours of faces.

use touchup_geometry::brep::{BrepFace, StandardUncertainty, UncertaintyUnit};

use super::instances::{InstanceId, Instances, list, real, string};
use super::product::{ProductIds, Units};

/// Adds for each face a shape aspect with one representation of its properties: its support, and
/// its standard uncertainties under the names of the numbers. These are the user-defined attributes
/// at faces of the recommended practices of CAx-IF.
pub(super) fn add_properties(
    out: &mut Instances,
    product: &ProductIds,
    faces: &[(&BrepFace, InstanceId)],
) {
    for (face, id) in faces {
        let support = if face.is_touched { "touched" } else { "scan" };
        let entity = format!("DESCRIPTIVE_REPRESENTATION_ITEM('support','{support}')");
        let mut items = vec![out.add(&entity)];
        let uncertainties = face.uncertainties.iter();
        items.extend(uncertainties.map(|one| out.add(&measure(one, &product.units))));
        let name = string(&face.name);
        let aspect = out.add(&format!("SHAPE_ASPECT({name},'',{},.T.)", product.shape));
        let (shape, context) = (product.representation, product.context);
        out.add(&format!(
            "GEOMETRIC_ITEM_SPECIFIC_USAGE('','',{aspect},{shape},{id})"
        ));
        let definition = "PROPERTY_DEFINITION('standard uncertainty','one standard deviation'";
        let property = out.add(&format!("{definition},{aspect})"));
        let items = list(&items);
        let entity = format!("REPRESENTATION('standard uncertainty',{items},{context})");
        let representation = out.add(&entity);
        out.add(&format!(
            "PROPERTY_DEFINITION_REPRESENTATION({property},{representation})"
        ));
    }
}

fn measure(one: &StandardUncertainty, units: &Units) -> String {
    let (name, value) = (string(&one.name), real(one.value));
    let (kind, unit) = match one.unit {
        UncertaintyUnit::Millimetre => ("LENGTH_MEASURE", units.millimetre),
        UncertaintyUnit::Degree => ("PLANE_ANGLE_MEASURE", units.degree),
    };
    format!("MEASURE_REPRESENTATION_ITEM({name},{kind}({value}),{unit})")
}

/// Red, green and blue of faces from the scan alone, and of touched ones.
const COLOURS: [(bool, [f64; 3]); 2] = [(false, [0.7, 0.7, 0.7]), (true, [0.2, 0.6, 0.9])];

/// Adds the colours of faces.
pub(super) fn add_colours(
    out: &mut Instances,
    product: &ProductIds,
    faces: &[(&BrepFace, InstanceId)],
) {
    let mut items = Vec::new();
    for (is_touched, rgb) in COLOURS {
        let mut coloured = faces
            .iter()
            .filter(|(face, _)| face.is_touched == is_touched);
        let Some(first) = coloured.next() else {
            continue;
        };
        let [red, green, blue] = rgb.map(real);
        let colour = out.add(&format!("COLOUR_RGB('',{red},{green},{blue})"));
        let fill = out.add(&format!("FILL_AREA_STYLE_COLOUR('',{colour})"));
        let area = out.add(&format!("FILL_AREA_STYLE('',({fill}))"));
        let surface = out.add(&format!("SURFACE_STYLE_FILL_AREA({area})"));
        let side = out.add(&format!("SURFACE_SIDE_STYLE('',({surface}))"));
        let usage = out.add(&format!("SURFACE_STYLE_USAGE(.BOTH.,{side})"));
        let style = out.add(&format!("PRESENTATION_STYLE_ASSIGNMENT(({usage}))"));
        for (_, face) in [first].into_iter().chain(coloured) {
            items.push(out.add(&format!("STYLED_ITEM('colour',({style}),{face})")));
        }
    }
    let kind = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION";
    out.add(&format!("{kind}('',{},{})", list(&items), product.context));
}
