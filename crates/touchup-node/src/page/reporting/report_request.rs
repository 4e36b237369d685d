//! Request of a report by a page: the source of the nominal values, and the flags of `touchup
//! inspect`.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use touchup_inspect::{InspectionParams, decision_rule, general_tolerance};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::nominal_file::is_nominal_file;
use touchup_io::session_folder::SessionFolder;

/// Maximum size of an uploaded CAD mesh, bytes.
const LARGEST_MESH: u64 = 64 << 20;
/// Maximum size of an uploaded table, bytes: some ten thousand characteristics.
const LARGEST_TABLE: u64 = 1 << 20;
/// Maximum length of a text in the head of the report, characters.
const LONGEST_TEXT: usize = 200;
/// Files of nominal values in a session folder.
const IN_SESSION: [&str; 2] = ["nominal.csv", "nominal.json"];

/// Source of nominal values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(in crate::page) enum NominalSource {
    /// the body of the request
    Upload,
    /// the nominal part of the node
    Part,
    /// a file in the folder of the session
    Session,
}

/// The query of a request; defaults are those of the command line.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::page) struct ReportRequest {
    pub nominal: NominalSource,
    /// name of the uploaded file, or of the file in the session folder
    #[serde(default)]
    file: String,
    /// unit of a CAD mesh; default: that of the session
    unit: Option<MeshUnit>,
    general: Option<String>,
    tolerance_mm: Option<f64>,
    position_mm: Option<f64>,
    match_mm: Option<f64>,
    align: Option<String>,
    rule: Option<String>,
    confidence: Option<f64>,
    k: Option<f64>,
    part: Option<String>,
    serial: Option<String>,
    operator: Option<String>,
}

impl ReportRequest {
    /// Settings of the inspection.
    ///
    /// - `unit`: of the session.
    ///
    /// # Errors
    /// In words: an invalid value.
    pub fn params(&self, unit: MeshUnit) -> Result<InspectionParams, String> {
        let mut params = InspectionParams::default();
        params.drawing.unit = self.unit.unwrap_or(unit);
        params.drawing.general = read("general", self.general.as_deref(), general_tolerance)?;
        (params.drawing.tolerance_mm, params.drawing.position_mm) =
            (self.tolerance_mm, self.position_mm);
        if params.drawing.general.is_some() && params.drawing.tolerance_mm.is_some() {
            return Err("general and tolerance_mm exclude each other: leave one out".to_owned());
        }
        params.decision.rule =
            read("rule", self.rule.as_deref(), decision_rule)?.unwrap_or(params.decision.rule);
        params.decision.confidence = self.confidence.unwrap_or(params.decision.confidence);
        params.coverage_factor = self.k.unwrap_or(params.coverage_factor);
        params.match_mm = self.match_mm.unwrap_or(params.match_mm);
        params.align = read("align", self.align.as_deref(), str::parse)?;
        params.part = text("part", &self.part)?;
        params.serial = text("serial", &self.serial)?;
        params.operator = text("operator", &self.operator)?;
        params.check().map_err(|error| error.to_string())?;
        Ok(params)
    }

    /// Name of the uploaded file, and its maximum size in bytes.
    ///
    /// # Errors
    /// In words: an unsupported file type.
    pub fn upload(&self) -> Result<(&str, u64), String> {
        let name = Path::new(&self.file);
        let ending = name
            .extension()
            .map(|ending| ending.to_ascii_lowercase())
            .unwrap_or_default();
        let is_mesh = ["ply", "stl", "obj"].iter().any(|known| ending == *known);
        match is_nominal_file(name) {
            true => Ok((&self.file, LARGEST_TABLE)),
            false if is_mesh => Ok((&self.file, LARGEST_MESH)),
            false => Err(format!(
                "\"{}\": hand in nominal values as .csv or .json, or a CAD mesh as .ply, .stl or .obj",
                self.file
            )),
        }
    }

    /// The file in the folder of a session.
    ///
    /// # Errors
    /// In words: an unknown file name, or a link to elsewhere.
    pub fn in_session(&self, session: &SessionFolder) -> Result<PathBuf, String> {
        if IN_SESSION.contains(&&*self.file) {
            session
                .place(&self.file, true)
                .map_err(|why| why.to_string())
        } else {
            Err(format!(
                "\"{}\": nominal values in the folder of a session are {}",
                self.file,
                IN_SESSION.join(" or ")
            ))
        }
    }
}

/// Parsed value of a field; an error names the field.
fn read<T>(
    field: &str,
    text: Option<&str>,
    of: fn(&str) -> Result<T, String>,
) -> Result<Option<T>, String> {
    text.map(of)
        .transpose()
        .map_err(|why| format!("{field}: {why}"))
}

/// A text of one line; `None` if empty.
fn text(name: &str, given: &Option<String>) -> Result<Option<String>, String> {
    let Some(text) = given
        .as_deref()
        .map(str::trim)
        .filter(|text| !text.is_empty())
    else {
        return Ok(None);
    };
    if text.chars().count() > LONGEST_TEXT || text.chars().any(char::is_control) {
        return Err(format!(
            "{name} has up to {LONGEST_TEXT} characters in one line"
        ));
    }
    Ok(Some(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_features::conformity::DecisionParams;
    use touchup_inspect::DrawingParams;

    fn request(json: serde_json::Value) -> ReportRequest {
        serde_json::from_value(json).unwrap()
    }

    /// The defaults are those in `touchup inspect --help`.
    #[test]
    fn what_is_left_out_is_as_on_the_command_line() {
        let params = request(serde_json::json!({ "nominal": "part" }))
            .params(MeshUnit::Inch)
            .unwrap();
        assert_eq!((params.coverage_factor, params.match_mm), (2.0, 1.5));
        assert_eq!(
            (params.decision.rule.name(), params.decision.confidence),
            ("iso14253", 0.95)
        );
        assert!(
            params.drawing.general.is_none()
                && params.drawing.unit == MeshUnit::Inch
                && params.part.is_none()
        );
    }

    #[test]
    fn each_field_is_the_setting_that_the_flag_of_its_name_is() {
        let asked = serde_json::json!({
            "nominal": "part", "unit": "inch", "general": "iso2768-f", "position_mm": 0.2, "match_mm": 0.5, "align": "best-fit",
            "rule": "simple", "confidence": 0.9, "k": 3.0, "part": " Plate 4711 ", "serial": "SN 1", "operator": "R. Ö",
        });
        let params = request(asked).params(MeshUnit::Metre).unwrap();
        let expected = InspectionParams {
            drawing: DrawingParams {
                unit: MeshUnit::Inch,
                general: Some(general_tolerance("iso2768-f").unwrap()),
                tolerance_mm: None,
                position_mm: Some(0.2),
            },
            decision: DecisionParams {
                rule: decision_rule("simple").unwrap(),
                confidence: 0.9,
            },
            coverage_factor: 3.0,
            match_mm: 0.5,
            align: Some("best-fit".parse().unwrap()),
            part: Some("Plate 4711".to_owned()),
            serial: Some("SN 1".to_owned()),
            operator: Some("R. Ö".to_owned()),
        };
        assert_eq!(format!("{params:?}"), format!("{expected:?}"));
        let own = serde_json::json!({ "nominal": "part", "tolerance_mm": 0.1 });
        let params = request(own).params(MeshUnit::Metre).unwrap();
        assert_eq!(params.drawing.tolerance_mm, Some(0.1));
    }

    #[test]
    fn what_is_no_value_is_refused_in_words() {
        for (field, value, words) in [
            ("general", "iso2768-x".into(), "iso2768-f, iso2768-m"),
            ("rule", "hope".into(), "iso14253"),
            ("align", "icp".into(), "align: take best-fit, or datums="),
            ("confidence", 0.5.into(), "above 0.5 and below 1"),
            ("k", 0.0.into(), "--k 0 must be above 0"),
            (
                "tolerance_mm",
                serde_json::json!(-1.0),
                "--tolerance-mm -1 must be above 0",
            ),
            ("part", "x".repeat(201).into(), "up to 200 characters"),
            ("operator", "a\nb".into(), "in one line"),
        ] {
            let mut asked = serde_json::json!({ "nominal": "part" });
            asked[field] = value;
            let why = request(asked).params(MeshUnit::Millimetre).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
        let unknown = serde_json::json!({ "nominal": "part", "out": "/etc/passwd" });
        assert!(serde_json::from_value::<ReportRequest>(unknown).is_err());
    }

    #[test]
    fn tables_and_meshes_are_handed_in_and_nothing_else_is() {
        let named = |file: &str| request(serde_json::json!({ "nominal": "upload", "file": file }));
        assert_eq!(named("plate.CSV").upload().unwrap().1, 1 << 20);
        assert_eq!(named("plate.stl").upload().unwrap().1, 64 << 20);
        for file in ["", "plate", "plate.exe", "plate.stl.gz"] {
            assert!(named(file).upload().is_err(), "{file}");
        }
        let parent = tempfile::tempdir().unwrap();
        let session = SessionFolder::create(parent.path(), "one").unwrap();
        assert_eq!(
            named("nominal.json").in_session(&session).unwrap(),
            session.path().join("nominal.json")
        );
        for file in ["../two/nominal.csv", "features.json", "/etc/passwd", ""] {
            assert!(named(file).in_session(&session).is_err(), "{file}");
        }
    }
}
