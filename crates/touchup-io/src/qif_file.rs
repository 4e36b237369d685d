use super::file_error::FileError;
use super::inspection_file::InspectionRecord;
use std::path::Path;
/// todo
pub fn write_qif(_: &Path, _: &InspectionRecord) -> Result<(), FileError> {
    Ok(())
}
