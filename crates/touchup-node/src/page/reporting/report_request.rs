//! Request of a report by a page: the source of the nominal values, and the flags of `touchup
//! inspect`.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use touchup_inspect::InspectionParams;
use touchup_io::file_kind::FileKind;
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
pub(in crate::page) struct ReportRequest {
    pub nominal: NominalSource,
    /// name of the uploaded file, or of the file in the session folder
    #[serde(default)]
    file: String,
    /// unit of a CAD mesh; default: that of the session
    unit: Option<MeshUnit>,
    /// names and values of flags of `touchup inspect`
    #[serde(flatten, deserialize_with = "settings")]
    settings: Vec<(String, String)>,
}

/// Entries of a map in their order; a repeated name stays, for the parser of the flags to refuse.
fn settings<'de, D: Deserializer<'de>>(query: D) -> Result<Vec<(String, String)>, D::Error> {
    struct Settings;
    impl<'de> Visitor<'de> for Settings {
        type Value = Vec<(String, String)>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("settings by name")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            std::iter::from_fn(|| map.next_entry().transpose()).collect()
        }
    }
    query.deserialize_map(Settings)
}

impl ReportRequest {
    /// Settings of the inspection.
    ///
    /// - `unit`: of the session.
    ///
    /// # Errors
    /// In words: an invalid value.
    pub fn params(&self, unit: MeshUnit) -> Result<InspectionParams, String> {
        let unit = ("nominal_unit", self.unit.unwrap_or(unit).name());
        let settings = self
            .settings
            .iter()
            .map(|(name, value)| (name.as_str(), value.as_str()));
        let mut params = InspectionParams::named(settings.chain([unit]))?;
        let report = &mut params.report;
        report.part = text("part", &report.part)?;
        report.serial = text("serial", &report.serial)?;
        report.operator = text("operator", &report.operator)?;
        params.check().map_err(|error| error.to_string())?;
        Ok(params)
    }

    /// Name of the uploaded file, and its maximum size in bytes.
    ///
    /// # Errors
    /// In words: an unsupported file type.
    pub fn upload(&self) -> Result<(&str, u64), String> {
        let name = Path::new(&self.file);
        match FileKind::of(name) {
            _ if is_nominal_file(name) => Ok((&self.file, LARGEST_TABLE)),
            Some(kind) if FileKind::MESHES.contains(&kind) => Ok((&self.file, LARGEST_MESH)),
            _ => Err(format!(
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
    use touchup_features::conformity::{DecisionRule, GeneralTolerance};
    use touchup_inspect::{DrawingParams, ReportParams};

    fn request(json: serde_json::Value) -> ReportRequest {
        serde_json::from_value(json).unwrap()
    }

    /// The defaults are those in `touchup inspect --help`.
    #[test]
    fn what_is_left_out_is_as_on_the_command_line() {
        let params = request(serde_json::json!({ "nominal": "part" }))
            .params(MeshUnit::Inch)
            .unwrap();
        let InspectionParams { drawing, report } = params;
        assert_eq!((report.coverage_factor, drawing.match_mm), (2.0, 1.5));
        assert_eq!((report.rule.name(), report.confidence), ("iso14253", 0.95));
        assert!(
            drawing.general.is_none() && drawing.unit == MeshUnit::Inch && report.part.is_none()
        );
    }

    #[test]
    fn each_field_is_the_setting_that_the_flag_of_its_name_is() {
        let asked = serde_json::json!({
            "nominal": "part", "unit": "inch", "general": "iso2768-f", "position_mm": "0.2", "match_mm": "0.5", "align": "best-fit",
            "rule": "simple", "confidence": "0.9", "k": "3", "part": " Plate 4711 ", "serial": "SN 1", "operator": "R. Ö",
        });
        let params = request(asked).params(MeshUnit::Metre).unwrap();
        let expected = InspectionParams {
            drawing: DrawingParams {
                unit: MeshUnit::Inch,
                general: Some(GeneralTolerance::Fine),
                tolerance_mm: None,
                position_mm: Some(0.2),
                match_mm: 0.5,
                align: Some("best-fit".parse().unwrap()),
            },
            report: ReportParams {
                rule: DecisionRule::Simple,
                confidence: 0.9,
                coverage_factor: 3.0,
                part: Some("Plate 4711".to_owned()),
                serial: Some("SN 1".to_owned()),
                operator: Some("R. Ö".to_owned()),
            },
        };
        assert_eq!(format!("{params:?}"), format!("{expected:?}"));
        let own = serde_json::json!({ "nominal": "part", "tolerance_mm": "0.1" });
        let params = request(own).params(MeshUnit::Metre).unwrap();
        assert_eq!(params.drawing.tolerance_mm, Some(0.1));
    }

    #[test]
    fn what_is_no_value_is_refused_in_words() {
        for (field, value, words) in [
            ("general", "iso2768-x", "iso2768-f, iso2768-m"),
            ("rule", "hope", "iso14253"),
            ("align", "icp", "'--align <HOW>': take best-fit, or datums="),
            ("confidence", "0.5", "above 0.5 and below 1"),
            ("confidence", "much", "'much' for '--confidence <P>'"),
            ("k", "0", "--k 0 must be above 0"),
            ("tolerance_mm", "-1", "--tolerance-mm -1 must be above 0"),
            ("part", &*"x".repeat(201), "up to 200 characters"),
            ("operator", "a\nb", "in one line"),
            ("out", "/etc/passwd", "'--out'"),
            ("help", "", "'--help'"),
            ("nominal_unit", "mm", "multiple times"),
            ("", "", "'--'"),
        ] {
            let mut asked = serde_json::json!({ "nominal": "part" });
            asked[field] = value.into();
            let why = request(asked).params(MeshUnit::Millimetre).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
        let both =
            serde_json::json!({ "nominal": "part", "general": "iso2768-f", "tolerance_mm": "1" });
        let why = request(both).params(MeshUnit::Millimetre).unwrap_err();
        assert!(why.contains("cannot be used with"), "{why}");
        let repeated = r#"{ "nominal": "part", "k": "1", "k": "2" }"#;
        let request: ReportRequest = serde_json::from_str(repeated).unwrap();
        let why = request.params(MeshUnit::Millimetre).unwrap_err();
        assert!(why.contains("'--k <K>' cannot be used multiple"), "{why}");
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
