//! The product: its identification, units, accuracy and shape.

use nalgebra::{Point3, Vector3};
use touchup_geometry::brep::AxisPlacement;

use super::instances::{InstanceId, Instances, list, millimetres, real, string};
use super::shape::{ShapeItems, add_placement};

/// Units of measures.
pub(super) struct Units {
    pub(super) millimetre: InstanceId,
    pub(super) degree: InstanceId,
}

/// Instances to which properties refer.
pub(super) struct ProductIds {
    pub(super) units: Units,
    /// units and accuracy of the geometry
    pub(super) context: InstanceId,
    /// the shape as a property of the product
    pub(super) shape: InstanceId,
    /// the shape as geometry
    pub(super) representation: InstanceId,
}

/// Adds a product with a shape.
///
/// - `tolerance`: accuracy of the geometry, m.
pub(super) fn add_product(
    out: &mut Instances,
    name: &str,
    shape_items: &ShapeItems,
    tolerance: f64,
) -> ProductIds {
    let (units, context) = add_context(out, tolerance);
    let origin = AxisPlacement {
        origin: Point3::origin(),
        axis: Vector3::z(),
        reference: Vector3::x(),
    };
    let mut items = vec![add_placement(out, &origin)];
    items.extend(&shape_items.items);
    let kind = shape_items.representation;
    let representation = out.add(&format!("{kind}('',{},{context})", list(&items)));
    let application = out.add("APPLICATION_CONTEXT('managed model based 3d engineering')");
    out.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard',\
         'ap242_managed_model_based_3d_engineering',2014,{application})"
    ));
    let discipline = out.add(&format!("PRODUCT_CONTEXT('',{application},'mechanical')"));
    let name = string(name);
    let product = out.add(&format!("PRODUCT({name},{name},'',({discipline}))"));
    out.add(&format!(
        "PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))"
    ));
    let version = out.add(&format!("PRODUCT_DEFINITION_FORMATION('','',{product})"));
    let entity = format!("PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')");
    let stage = out.add(&entity);
    let definition = out.add(&format!(
        "PRODUCT_DEFINITION('design','',{version},{stage})"
    ));
    let shape = out.add(&format!("PRODUCT_DEFINITION_SHAPE('','',{definition})"));
    out.add(&format!(
        "SHAPE_DEFINITION_REPRESENTATION({shape},{representation})"
    ));
    ProductIds {
        units,
        context,
        shape,
        representation,
    }
}

fn add_context(out: &mut Instances, tolerance: f64) -> (Units, InstanceId) {
    let millimetre = out.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let radian = out.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let steradian = out.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let no_dimension = out.add("DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.)");
    let one_degree = real(1f64.to_radians());
    let entity =
        format!("PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({one_degree}),{radian})");
    let in_radians = out.add(&entity);
    let degree = out.add(&format!(
        "(CONVERSION_BASED_UNIT('DEGREE',{in_radians})NAMED_UNIT({no_dimension})PLANE_ANGLE_UNIT())"
    ));
    let accuracy = out.add(&format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{millimetre},'distance_accuracy_value',\
         'largest distance between elements that meet')",
        millimetres(tolerance),
    ));
    let context = out.add(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({accuracy}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({millimetre},{radian},{steradian}))\
         REPRESENTATION_CONTEXT('','3D'))"
    ));
    (Units { millimetre, degree }, context)
}
