//! Results of an inspection as QIF 3.0 (ANSI/DMSC QIF 3.0, ISO 23952:2020), for metrology programs.
//!
//! The file holds the characteristics in their four aspects, definition, nominal, item and
//! measurement, each measured value with its standard uncertainty, and the status of the part. It
//! omits features, datum reference frames and touches.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use super::file_error::{FileError, write_file};
use super::inspection_file::{CharacteristicRecord, InspectionRecord};
use touchup_features::features::InspectedQuantity;

/// Writes an inspection, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_qif(path: &Path, record: &InspectionRecord) -> Result<(), FileError> {
    let text = document(record);
    write_file(path, |out| out.write_all(text.as_bytes()))
}

/// Identifiers: of the component, the results, the standard that defines the characteristics, then
/// four of each characteristic.
const COMPONENT: usize = 1;
const RESULTS: usize = 2;
const STANDARD: usize = 3;

struct Ids {
    definition: usize,
    nominal: usize,
    item: usize,
    measurement: usize,
}

fn ids(at: usize) -> Ids {
    let first = STANDARD + 1 + 4 * at;
    Ids {
        definition: first,
        nominal: first + 1,
        item: first + 2,
        measurement: first + 3,
    }
}

fn document(record: &InspectionRecord) -> String {
    let all = &record.characteristics;
    let each = |aspect: fn(&CharacteristicRecord, &Ids) -> String| {
        all.iter()
            .enumerate()
            .map(|(at, one)| aspect(one, &ids(at)))
            .collect::<String>()
    };
    let (count, last) = (all.len(), ids(all.len()).definition - 1);
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<QIFDocument xmlns="http://qifstandards.org/xsd/qif3" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://qifstandards.org/xsd/qif3 QIFApplications/QIFDocument.xsd" versionQIF="3.0.0" idMax="{last}">
<QPId>{id}</QPId>
<Version><TimeCreated>{date}</TimeCreated></Version>
<Header><Application><Name>{program}</Name></Application></Header>
<StandardsDefinitions n="1">
<Standard id="{STANDARD}"><Organization><StandardsOrganizationEnum>ISO</StandardsOrganizationEnum></Organization><Designator>1101:2017</Designator></Standard>
</StandardsDefinitions>
<FileUnits><PrimaryUnits>
<AngularUnit><SIUnitName>radian</SIUnitName><UnitName>degree</UnitName><UnitConversion><Factor>0.017453292519943295</Factor></UnitConversion></AngularUnit>
<LinearUnit><SIUnitName>meter</SIUnitName><UnitName>mm</UnitName><UnitConversion><Factor>0.001</Factor></UnitConversion></LinearUnit>
</PrimaryUnits></FileUnits>
<Characteristics>
<FormalStandardId>{STANDARD}</FormalStandardId>
<CharacteristicDefinitions n="{count}">
{definitions}</CharacteristicDefinitions>
<CharacteristicNominals n="{count}">
{nominals}</CharacteristicNominals>
<CharacteristicItems n="{count}">
{items}</CharacteristicItems>
</Characteristics>
{results}</QIFDocument>
"#,
        id = document_id(record),
        date = escaped(&record.date),
        program = escaped(&record.program),
        definitions = each(definition),
        nominals = each(nominal),
        items = each(item),
        results = results(record, &each(measurement)),
    )
}

/// Results and status of the part.
fn results(record: &InspectionRecord, measurements: &str) -> String {
    let count = record.characteristics.len();
    let status = match &*record.verdict {
        "pass" => "PASS",
        "fail" => "FAIL",
        _ => "UNKNOWN",
    };
    let confidence = record.confidence.to_string();
    // rows of rotation and translation, mm
    let motion = record.alignment.as_ref().map(|found| {
        let rows = [0, 1, 2].map(|i| {
            let [x, y, z] = found.rotation[i];
            format!("{x} {y} {z} {}", found.translation_mm[i])
        });
        ("mesh_to_drawing", rows.join("; "))
    });
    let told = |name: &'static str, text: &Option<String>| text.clone().map(|text| (name, text));
    let of_results = [
        told("operator", &record.operator),
        Some(("decision_rule", record.rule.clone())),
        Some(("confidence", confidence)),
        Some(("frame", record.frame())),
        motion,
    ];
    let of_component = attributes(told("part", &record.part));
    let serial = record.serial.as_ref().map_or(String::new(), |serial| {
        format!("<SerialNumber>{}</SerialNumber>", escaped(serial))
    });
    let of_results = attributes(of_results.into_iter().flatten());
    format!(
        r#"<Results>
<MeasurementResultsSet n="1">
<MeasurementResults id="{RESULTS}">
{of_results}<MeasuredCharacteristics>
<CharacteristicMeasurements n="{count}">
{measurements}</CharacteristicMeasurements>
</MeasuredCharacteristics>
<InspectionStatus><InspectionStatusEnum>{status}</InspectionStatusEnum></InspectionStatus>
<ActualComponentIds n="1"><Id>{COMPONENT}</Id></ActualComponentIds>
</MeasurementResults>
</MeasurementResultsSet>
<ActualComponentSets n="1"><ActualComponentSet n="1">
<ActualComponent id="{COMPONENT}">{of_component}{serial}<Status><InspectionStatusEnum>{status}</InspectionStatusEnum></Status></ActualComponent>
</ActualComponentSet></ActualComponentSets>
</Results>
"#
    )
}

/// Name of the characteristic in QIF.
fn name_of(one: &CharacteristicRecord) -> String {
    let quantity = InspectedQuantity::of_name(&one.quantity).unwrap_or(InspectedQuantity::Diameter);
    match quantity {
        InspectedQuantity::Depth if one.kind == "boss" => "Height",
        InspectedQuantity::ConeAngle => "Angle",
        InspectedQuantity::X | InspectedQuantity::Y | InspectedQuantity::Z => "LinearCoordinate",
        InspectedQuantity::Roundness => "Circularity",
        InspectedQuantity::Distance => "DistanceBetween",
        InspectedQuantity::Angle => "AngleBetween",
        _ => return format!("{quantity:?}"),
    }
    .to_owned()
}

/// One element of an aspect.
fn aspect(one: &CharacteristicRecord, aspect: &str, id: usize, content: &str) -> String {
    let name = format!("{}Characteristic{aspect}", name_of(one));
    format!("<{name} id=\"{id}\">{content}</{name}>\n")
}

fn definition(one: &CharacteristicRecord, ids: &Ids) -> String {
    let is_zone = InspectedQuantity::of_name(&one.quantity).is_some_and(InspectedQuantity::is_zone);
    let (lower, upper) = (one.number("lower_limit"), one.number("upper_limit"));
    let content = if is_zone {
        let width = format!("<ToleranceValue>{}</ToleranceValue>", upper.unwrap_or(0.0));
        let round = "<ZoneShape><DiametricalZone/></ZoneShape>";
        let is_plane = one.kind == "plane";
        let (material, shape) = match &*name_of(one) {
            "Position" => ("<MaterialCondition>REGARDLESS</MaterialCondition>", round),
            "Perpendicularity" | "Parallelism" if is_plane => (
                "<MaterialCondition>REGARDLESS</MaterialCondition>",
                "<ZoneShape><PlanarZone/></ZoneShape>",
            ),
            "Perpendicularity" | "Parallelism" => {
                ("<MaterialCondition>REGARDLESS</MaterialCondition>", round)
            }
            "Coaxiality" | "Concentricity" | "Straightness" => ("", round),
            _ => ("", ""),
        };
        format!("{width}{material}{shape}")
    } else {
        let limit = |name: &str, value: Option<f64>| {
            value.map_or(String::new(), |value| format!("<{name}>{value}</{name}>"))
        };
        let (max, min) = (limit("MaxValue", upper), limit("MinValue", lower));
        format!("<Tolerance>{max}{min}<DefinedAsLimit>true</DefinedAsLimit></Tolerance>")
    };
    aspect(one, "Definition", ids.definition, &content)
}

fn nominal(one: &CharacteristicRecord, ids: &Ids) -> String {
    let mut content = format!(
        "<CharacteristicDefinitionId>{}</CharacteristicDefinitionId>",
        ids.definition
    );
    let quantity = InspectedQuantity::of_name(&one.quantity);
    if !quantity.is_some_and(InspectedQuantity::is_zone) {
        let _ = write!(
            content,
            "<TargetValue>{}</TargetValue>",
            one.number("nominal").unwrap_or(0.0)
        );
    }
    content += match quantity {
        Some(InspectedQuantity::X) => "<Direction>XAXIS</Direction>",
        Some(InspectedQuantity::Y) => "<Direction>YAXIS</Direction>",
        Some(InspectedQuantity::Z) => "<Direction>ZAXIS</Direction>",
        Some(InspectedQuantity::Distance | InspectedQuantity::Angle) => {
            "<AnalysisMode>THREEDIMENSIONAL</AnalysisMode>"
        }
        _ => "",
    };
    aspect(one, "Nominal", ids.nominal, &content)
}

fn item(one: &CharacteristicRecord, ids: &Ids) -> String {
    let content = format!(
        "<Description>{}</Description><Name>{}</Name><CharacteristicDesignator><Designator>{}</Designator></CharacteristicDesignator>\
         <CharacteristicNominalId>{}</CharacteristicNominalId>",
        escaped(&format!("{} of {}", one.quantity, one.kind)),
        token(&one.name),
        token(&one.number),
        ids.nominal
    );
    aspect(one, "Item", ids.item, &content)
}

fn measurement(one: &CharacteristicRecord, ids: &Ids) -> String {
    let actual = one.number("actual");
    let status = match &*one.decision {
        "pass" => "PASS",
        "fail" => "FAIL",
        _ if actual.is_none() => "NOT_ANALYZED",
        _ => "INDETERMINATE",
    };
    let bound = actual
        .filter(|_| one.is_at_least)
        .map(|bound| ("lower_bound", bound.to_string()));
    let probability = one
        .conformance_probability
        .map(|probability| ("conformance_probability", probability.to_string()));
    let reason = one.reason.clone().map(|reason| ("reason", reason));
    let mut content = attributes([bound, probability, reason].into_iter().flatten());
    let _ = write!(
        content,
        "<Status><CharacteristicStatusEnum>{status}</CharacteristicStatusEnum></Status><CharacteristicItemId>{}</CharacteristicItemId>",
        ids.item
    );
    if name_of(one) == "LinearCoordinate" {
        content +=
            "<TypeOfCoordinates><CoordinateEnum>CARTESIAN_3D</CoordinateEnum></TypeOfCoordinates>";
    }
    // a bound is no measured value
    if let Some(actual) = actual.filter(|_| !one.is_at_least) {
        let accuracy = one
            .number("standard_uncertainty")
            .map_or(String::new(), |u| {
                format!(" combinedUncertainty=\"{u}\" meanError=\"0\"")
            });
        let _ = write!(content, "<Value{accuracy}>{actual}</Value>");
    }
    aspect(one, "Measurement", ids.measurement, &content)
}

/// Data without a place in QIF, under names of this program.
fn attributes(all: impl IntoIterator<Item = (&'static str, String)>) -> String {
    let each: Vec<_> = all
        .into_iter()
        .map(|(name, value)| {
            format!(
                "<AttributeStr name=\"touchup.{name}\" value=\"{}\"/>",
                escaped(&value)
            )
        })
        .collect();
    if each.is_empty() {
        String::new()
    } else {
        format!(
            "<Attributes n=\"{}\">{}</Attributes>",
            each.len(),
            each.concat()
        )
    }
}

/// A text of one line, without blanks at its ends.
fn token(text: &str) -> String {
    escaped(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// A text in XML; characters invalid in XML 1.0 are replaced.
fn escaped(text: &str) -> String {
    let mut xml = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => xml += "&amp;",
            '<' => xml += "&lt;",
            '>' => xml += "&gt;",
            '"' => xml += "&quot;",
            '\t' | '\n' | '\r' => xml.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => xml.push('\u{fffd}'),
            other => xml.push(other),
        }
    }
    xml
}

/// Identifier, equal for equal results: FNV-1a of 128 bits [Fowler, Noll and Vo] over them, as a
/// UUID of version 8 (RFC 9562).
fn document_id(record: &InspectionRecord) -> String {
    const BASIS: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let text = serde_json::to_vec(record).unwrap_or_default();
    let hash = text.iter().fold(BASIS, |hash, byte| {
        (hash ^ u128::from(*byte)).wrapping_mul(PRIME)
    });
    let marked = hash & !(0xf << 76) & !(0b11 << 62) | 8 << 76 | 0b10 << 62;
    let hex = format!("{marked:032x}");
    [
        &hex[..8],
        &hex[8..12],
        &hex[12..16],
        &hex[16..20],
        &hex[20..],
    ]
    .join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> InspectionRecord {
        let characteristic = |quantity: &InspectedQuantity| {
            let mut one = CharacteristicRecord {
                number: "1.1".to_owned(),
                name: format!("a <b> & \"c\" {quantity}"),
                kind: "hole".to_owned(),
                quantity: quantity.name().to_owned(),
                decision: "undecided".to_owned(),
                ..CharacteristicRecord::default()
            };
            let numbers = [
                ("nominal", 8.0),
                ("upper_limit", 8.1),
                ("actual", 8.000_000_1),
                ("standard_uncertainty", 1e-9),
            ];
            numbers
                .into_iter()
                .for_each(|(name, number)| one.set(name, Some(number)));
            one
        };
        let characteristics = InspectedQuantity::ALL.iter().map(characteristic).collect();
        InspectionRecord {
            characteristics,
            verdict: "undecided".to_owned(),
            ..InspectionRecord::default()
        }
    }

    #[test]
    fn every_quantity_has_four_aspects_that_refer_to_one_another() {
        let record = record();
        let text = document(&record);
        let document = roxmltree::Document::parse(&text).unwrap();
        let ids: Vec<usize> = document
            .descendants()
            .filter_map(|node| node.attribute("id")?.parse().ok())
            .collect();
        let mut once = ids.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), ids.len(), "an id is there twice");
        assert_eq!(
            document.root_element().attribute("idMax"),
            Some(&*once.last().unwrap().to_string())
        );
        let by_id = |id: &str| {
            document
                .descendants()
                .find(|node| node.attribute("id") == Some(id))
                .unwrap()
        };
        let refer = |node: roxmltree::Node<'_, '_>, name: &str| {
            node.children()
                .find(|child| child.has_tag_name(("http://qifstandards.org/xsd/qif3", name)))
                .unwrap()
                .text()
                .unwrap()
                .to_owned()
        };
        let measurements: Vec<_> = document
            .descendants()
            .filter(|node| {
                node.tag_name()
                    .name()
                    .ends_with("CharacteristicMeasurement")
            })
            .collect();
        assert_eq!(measurements.len(), InspectedQuantity::ALL.len());
        for node in measurements {
            let kind = node
                .tag_name()
                .name()
                .trim_end_matches("Measurement")
                .to_owned();
            let item = by_id(&refer(node, "CharacteristicItemId"));
            let nominal = by_id(&refer(item, "CharacteristicNominalId"));
            let definition = by_id(&refer(nominal, "CharacteristicDefinitionId"));
            let names = [item, nominal, definition].map(|node| node.tag_name().name().to_owned());
            assert_eq!(
                names,
                ["Item", "Nominal", "Definition"].map(|aspect| format!("{kind}{aspect}"))
            );
        }
    }

    /// xs:decimal has no exponents.
    #[test]
    fn small_numbers_are_written_without_exponent() {
        let text = document(&record());
        assert!(
            text.contains("combinedUncertainty=\"0.000000001\""),
            "{text}"
        );
    }

    #[test]
    fn the_identifier_is_a_uuid_that_follows_the_results() {
        let first = document_id(&record());
        assert_eq!(first, document_id(&record()));
        assert_ne!(
            first,
            document_id(&InspectionRecord {
                serial: Some("2".to_owned()),
                ..record()
            })
        );
        assert_eq!((first.len(), &first[14..15]), (36, "8"));
        assert!("89ab".contains(&first[19..20]), "{first}");
    }
}
