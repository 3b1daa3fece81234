//! The values that a DCF wants its device to have, as an SDO carries them (CiA 306-1, clause 5: `ParameterValue`).

use canopen::Mux;
use canopen::od::{DataType, Kind};

use crate::describe::bytes_of_text;
use crate::{Eds, Value, Variable};

/// A value of a file that its object cannot hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotHeld {
    /// The line of the object's section, from 1.
    pub line: u32,
    /// The object.
    pub object: Mux,
    /// What the file says.
    pub value: String,
    /// The type that it was to be of.
    pub data_type: String,
}

impl std::fmt::Display for NotHeld {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} cannot hold '{}': it is of type {}", self.object, self.value, self.data_type)
    }
}

/// Every `ParameterValue` of a file, for the node of this ID. `UploadFile` and `DownloadFile` are not looked at.
pub fn parameter_values(eds: &Eds, node_id: u8) -> Vec<Result<(Mux, Vec<u8>), NotHeld>> {
    let values = eds.variables().filter_map(|(index, variable)| {
        let value = variable.value.as_ref()?;
        let object = Mux::new(index, variable.sub_index);
        Some(match bytes_of(variable, value, node_id) {
            Some(bytes) => Ok((object, bytes)),
            None => {
                let (line, value) = (variable.line, value.to_string());
                Err(NotHeld { line, object, value, data_type: variable.data_type.to_string() })
            }
        })
    });
    values.collect()
}

/// A value as an SDO carries it; `None` if it does not fit the type.
fn bytes_of(variable: &Variable, value: &Value, node_id: u8) -> Option<Vec<u8>> {
    let data_type = DataType::from_code(variable.data_type.0)?;
    let size = data_type.size();
    match (value, data_type.kind()) {
        (Value::Number(number), Kind::Signed | Kind::Unsigned) => {
            let (low, high) = variable.data_type.range()?;
            let number = number.at_node(node_id);
            (low..=high).contains(&number).then(|| number.to_le_bytes()[..size].to_vec())
        }
        (Value::Number(number), Kind::Real) => real(number.at_node(node_id) as f64, size),
        (Value::Real(number), Kind::Real) => real(*number, size),
        (Value::Text(text), Kind::Bytes | Kind::Time) => Some(bytes_of_text(data_type, text)),
        // A text of digits was read as a number.
        (Value::Number(number), Kind::Bytes) => Some(bytes_of_text(data_type, &number.to_string())),
        _ => None,
    }
}

fn real(number: f64, size: usize) -> Option<Vec<u8>> {
    if size == 4 { Some((number as f32).to_le_bytes().to_vec()) } else { Some(number.to_le_bytes().to_vec()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "[DeviceComissioning]\nNodeID=5\n";

    fn values(objects: &str) -> Vec<Result<(Mux, Vec<u8>), NotHeld>> {
        parameter_values(&Eds::load(format!("{HEAD}{objects}").as_bytes()).expect("a DCF").eds, 5)
    }

    fn object(data_type: &str, value: &str) -> String {
        format!("[2000]\nParameterName=X\nDataType={data_type}\nAccessType=rw\nParameterValue={value}\n")
    }

    #[test]
    fn values_are_bytes_in_the_order_of_the_wire() {
        let first = |data_type, value| values(&object(data_type, value)).remove(0).map(|(_, bytes)| bytes);
        assert_eq!(first("3", "-2"), Ok(vec![0xFE, 0xFF]));
        assert_eq!(first("7", "$NODEID+0x180"), Ok(vec![0x85, 1, 0, 0]));
        assert_eq!(first("8", "1.5"), Ok(vec![0, 0, 0xC0, 0x3F]));
        assert_eq!(first("9", "left"), Ok(b"left".to_vec()));
        assert_eq!(first("0x1B", "18446744073709551615"), Ok(vec![0xFF; 8]));
    }

    #[test]
    fn defaults_are_no_values() {
        assert_eq!(values("[2000]\nParameterName=X\nDataType=6\nAccessType=rw\nDefaultValue=5\n"), []);
    }
}
