//! A table as a Parquet file, each column with its type.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

use super::{Cell, ResultTable, text_of};

impl ResultTable {
    /// The bytes of the file.
    pub(super) fn parquet(&self) -> Result<Vec<u8>, ParquetError> {
        let field = |(name, column): &(String, Vec<Option<Cell>>)| {
            let (physical, logical) = match kind_of(column) {
                Kind::Number => (Physical::DOUBLE, None),
                Kind::Count => (Physical::INT64, None),
                Kind::Flag => (Physical::BOOLEAN, None),
                Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
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
enum Kind {
    Number,
    Count,
    Flag,
    Text,
}

/// Common type of a column: whole numbers among others are numbers; other mixtures and columns
/// without a value are text.
fn kind_of(column: &[Option<Cell>]) -> Kind {
    let is_all = |is: fn(&Cell) -> bool| column.iter().flatten().all(is);
    if column.iter().all(Option::is_none) {
        Kind::Text
    } else if is_all(|cell| matches!(cell, Cell::Count(_))) {
        Kind::Count
    } else if is_all(|cell| matches!(cell, Cell::Count(_) | Cell::Number(_))) {
        Kind::Number
    } else if is_all(|cell| matches!(cell, Cell::Flag(_))) {
        Kind::Flag
    } else {
        Kind::Text
    }
}

fn write_column(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    column: &[Option<Cell>],
) -> Result<(), ParquetError> {
    match kind_of(column) {
        Kind::Number => write_values::<DoubleType>(group, column, |cell| match cell {
            Cell::Number(number) => *number,
            Cell::Count(count) => *count as f64,
            Cell::Flag(_) | Cell::Text(_) => f64::NAN,
        }),
        Kind::Count => write_values::<Int64Type>(group, column, |cell| {
            if let Cell::Count(count) = cell {
                *count
            } else {
                0
            }
        }),
        Kind::Flag => {
            write_values::<BoolType>(group, column, |cell| matches!(cell, Cell::Flag(true)))
        }
        Kind::Text => write_values::<ByteArrayType>(group, column, |cell| {
            ByteArray::from(text_of(Some(cell)).into_bytes())
        }),
    }
}

fn write_values<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    column: &[Option<Cell>],
    value: impl Fn(&Cell) -> T::T,
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
