//! A table as a Parquet file, each column with its type.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::{ResultCell, ResultTable, text_of};

impl ResultTable {
    /// The bytes of the file.
    pub(super) fn parquet(&self) -> Result<Vec<u8>, ParquetError> {
        let field = |(name, column): &(String, Vec<Option<ResultCell>>)| {
            let (physical, logical) = match kind_of(column) {
                ColumnKind::Number => (Physical::DOUBLE, None),
                ColumnKind::Count => (Physical::INT64, None),
                ColumnKind::Flag => (Physical::BOOLEAN, None),
                ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            };
            let field = Type::primitive_type_builder(name, physical).with_logical_type(logical);
            field
                .with_repetition(Repetition::OPTIONAL)
                .build()
                .map(Arc::new)
        };
        let fields = self
            .columns
            .iter()
            .map(field)
            .collect::<Result<Vec<_>, _>>()?;
        let schema = Arc::new(
            Type::group_type_builder("touchup")
                .with_fields(fields)
                .build()?,
        );
        let mut writer = SerializedFileWriter::new(
            Vec::new(),
            schema,
            Arc::new(WriterProperties::builder().build()),
        )?;
        let mut group = writer.next_row_group()?;
        for (_, column) in &self.columns {
            write_column(&mut group, column)?;
        }
        group.close()?;
        writer.into_inner()
    }
}

/// The type of a column.
enum ColumnKind {
    Number,
    Count,
    Flag,
    Text,
}

/// Common type of a column: whole numbers among others are numbers; other mixtures and columns
/// without a value are text.
fn kind_of(column: &[Option<ResultCell>]) -> ColumnKind {
    let is_all = |is: fn(&ResultCell) -> bool| column.iter().flatten().all(is);
    if column.iter().all(Option::is_none) {
        ColumnKind::Text
    } else if is_all(|cell| matches!(cell, ResultCell::Count(_))) {
        ColumnKind::Count
    } else if is_all(|cell| matches!(cell, ResultCell::Count(_) | ResultCell::Number(_))) {
        ColumnKind::Number
    } else if is_all(|cell| matches!(cell, ResultCell::Flag(_))) {
        ColumnKind::Flag
    } else {
        ColumnKind::Text
    }
}

fn write_column(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    column: &[Option<ResultCell>],
) -> Result<(), ParquetError> {
    match kind_of(column) {
        ColumnKind::Number => write_values::<DoubleType>(group, column, |cell| match cell {
            ResultCell::Number(number) => *number,
            ResultCell::Count(count) => *count as f64,
            ResultCell::Flag(_) | ResultCell::Text(_) => f64::NAN,
        }),
        ColumnKind::Count => write_values::<Int64Type>(group, column, |cell| {
            if let ResultCell::Count(count) = cell {
                *count
            } else {
                0
            }
        }),
        ColumnKind::Flag => {
            write_values::<BoolType>(group, column, |cell| matches!(cell, ResultCell::Flag(true)))
        }
        ColumnKind::Text => write_values::<ByteArrayType>(group, column, |cell| {
            ByteArray::from(text_of(Some(cell)).into_bytes())
        }),
    }
}

fn write_values<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    column: &[Option<ResultCell>],
    value: impl Fn(&ResultCell) -> T::T,
) -> Result<(), ParquetError> {
    let values: Vec<T::T> = column.iter().flatten().map(value).collect();
    // a present optional value has level 1
    let levels: Vec<i16> = column
        .iter()
        .map(|cell| i16::from(cell.is_some()))
        .collect();
    if let Some(mut writer) = group.next_column()? {
        writer
            .typed::<T>()
            .write_batch(&values, Some(&levels), None)?;
        writer.close()?;
    }
    Ok(())
}
