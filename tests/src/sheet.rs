//! Devices for tests, as the files that describe them.

/// Index, sub-index, data type by its code, access, default, and whether it can be mapped.
pub type SheetRow = (u16, u8, u16, &'static str, u64, bool);

/// Codes of data types (CiA 301, table 44).
pub const U8: u16 = 5;
/// UNSIGNED16.
pub const U16: u16 = 6;
/// UNSIGNED32.
pub const U32: u16 = 7;
/// DOMAIN.
pub const DOMAIN: u16 = 0xF;
/// UNSIGNED64.
pub const U64: u16 = 0x1B;

/// The rows as an EDS file (CiA 306); those of one index side by side.
#[must_use]
pub fn sheet(rows: &[SheetRow]) -> Vec<u8> {
    let mut text =
        "[FileInfo]\nFileName=services.eds\n[DeviceInfo]\nVendorName=None\nProductName=Services\n".to_owned();
    let mut records: Vec<u16> = rows.iter().filter(|row| row.1 > 0).map(|row| row.0).collect();
    records.dedup();
    for record in records {
        let highest = rows.iter().filter(|row| row.0 == record).map(|row| row.1).max().unwrap_or(0);
        text += &format!("[{record:X}]\nParameterName=R{record:X}\nObjectType=9\nSubNumber={}\n", highest + 1);
    }
    for (index, sub_index, data_type, access, default, mappable) in rows {
        let is_record = rows.iter().any(|row| row.0 == *index && row.1 > 0);
        let section = if is_record { format!("{index:X}sub{sub_index:X}") } else { format!("{index:X}") };
        text += &format!(
            "[{section}]\nParameterName=O{index:X}_{sub_index}\nDataType={data_type}\nAccessType={access}\n\
             DefaultValue={default}\nPDOMapping={}\n",
            u8::from(*mappable)
        );
    }
    text.into_bytes()
}
