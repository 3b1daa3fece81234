//! Writing: an [`Eds`] as the text of a file, as CiA 306 has it and as strict tools take it.
//!
//! Counts are decimal, each object stands in exactly one list, identifiers are hexadecimal. Compact sub-objects are written
//! out one by one. A file that is to keep its lines and comments is changed through its
//! [`Document`](crate::document::Document).

use std::fmt::{self, Write};

use crate::{Commissioning, Eds, KeptSection, List, Number, Object, TypeCode, Value, Variable};

/// The text of a file.
///
/// ```
/// use eds::{Eds, write};
///
/// let text = "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\n";
/// let eds = Eds::load(text.as_bytes()).map(|reading| reading.eds)?;
/// let written = write(&eds);
/// assert!(written.contains("[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n"));
/// assert!(written.contains("[1000]\nParameterName=Device type\nObjectType=0x7\nDataType=0x0007\n"));
/// # Ok::<(), eds::Refusal>(())
/// ```
pub fn write(eds: &Eds) -> String {
    let mut file = File { text: String::with_capacity(4_096 + 160 * eds.objects.len()) };
    // A String takes any text.
    let _ = file.all(eds);
    file.text
}

struct File {
    text: String,
}

impl File {
    fn all(&mut self, eds: &Eds) -> fmt::Result {
        self.file_info(eds)?;
        self.device_info(eds)?;
        if let Some(commissioning) = &eds.commissioning {
            self.commissioning(commissioning)?;
        }
        self.section("DummyUsage")?;
        for (code, allowed) in &eds.dummies {
            writeln!(self.text, "Dummy{:04X}={}", code.0, u8::from(*allowed))?;
        }
        self.section("Comments")?;
        self.entry("Lines", eds.comments.len())?;
        for (number, line) in (1..).zip(&eds.comments) {
            self.entry(&format!("Line{number}"), one_line(line))?;
        }
        self.dynamic_channels(eds)?;
        for list in List::ALL {
            let of_list = |object: &&Object| object.list.unwrap_or(List::of(object.index)) == list;
            let objects: Vec<&Object> = eds.objects.iter().filter(of_list).collect();
            self.list(list, &objects)?;
            objects.into_iter().try_for_each(|object| self.object(object))?;
        }
        eds.kept.iter().try_for_each(|section| self.kept(section))
    }

    fn section(&mut self, name: &str) -> fmt::Result {
        let gap = if self.text.is_empty() { "" } else { "\n" };
        writeln!(self.text, "{gap}[{name}]")
    }

    fn entry(&mut self, key: &str, value: impl fmt::Display) -> fmt::Result {
        writeln!(self.text, "{key}={value}")
    }

    /// An entry that is left out when there is nothing to say.
    fn said(&mut self, key: &str, value: Option<impl fmt::Display>) -> fmt::Result {
        value.map_or(Ok(()), |value| self.entry(key, value))
    }

    fn file_info(&mut self, eds: &Eds) -> fmt::Result {
        let file = &eds.file;
        self.section("FileInfo")?;
        self.entry("FileName", one_line(&file.file_name))?;
        self.said("FileVersion", file.file_version)?;
        self.said("FileRevision", file.file_revision)?;
        let texts = [
            ("EDSVersion", &file.eds_version),
            ("Description", &file.description),
            ("CreationTime", &file.creation_time),
            ("CreationDate", &file.creation_date),
            ("CreatedBy", &file.created_by),
            ("ModificationTime", &file.modification_time),
            ("ModificationDate", &file.modification_date),
            ("ModifiedBy", &file.modified_by),
        ];
        texts.into_iter().try_for_each(|(key, text)| self.entry(key, one_line(text)))?;
        self.said("LastEDS", present(&file.last_eds))
    }

    fn device_info(&mut self, eds: &Eds) -> fmt::Result {
        let device = &eds.device;
        self.section("DeviceInfo")?;
        self.entry("VendorName", one_line(&device.vendor_name))?;
        self.said("VendorNumber", device.vendor_number.map(Hex))?;
        self.entry("ProductName", one_line(&device.product_name))?;
        self.said("ProductNumber", device.product_number.map(Hex))?;
        self.said("RevisionNumber", device.revision_number.map(Hex))?;
        self.entry("OrderCode", one_line(&device.order_code))?;
        for rate in crate::BIT_RATES {
            self.entry(&format!("BaudRate_{rate}"), u8::from(device.bit_rates.contains(&rate)))?;
        }
        self.entry("SimpleBootUpMaster", u8::from(device.simple_boot_up_master))?;
        self.entry("SimpleBootUpSlave", u8::from(device.simple_boot_up_slave))?;
        self.entry("Granularity", device.granularity)?;
        self.entry("DynamicChannelsSupported", device.dynamic_channels_supported)?;
        self.entry("GroupMessaging", u8::from(device.group_messaging))?;
        self.said("NrOfRXPDO", device.rpdos)?;
        self.said("NrOfTXPDO", device.tpdos)?;
        self.entry("LSS_Supported", u8::from(device.lss))?;
        self.said("CompactPDO", Some(device.compact_pdo).filter(|bits| *bits > 0))
    }

    fn commissioning(&mut self, commissioning: &Commissioning) -> fmt::Result {
        // With one m: so the standard spells it.
        self.section("DeviceComissioning")?;
        self.said("NodeID", commissioning.node_id)?;
        self.entry("NodeName", one_line(&commissioning.node_name))?;
        self.said("NodeRefd", present(&commissioning.node_reference))?;
        self.said("Baudrate", commissioning.bit_rate)?;
        self.said("NetNumber", commissioning.net_number)?;
        self.said("NetworkName", present(&commissioning.network_name))?;
        self.said("NetRefd", present(&commissioning.network_reference))?;
        self.entry("CANopenManager", u8::from(commissioning.is_manager))?;
        self.said("LSS_SerialNumber", commissioning.lss_serial_number.map(Hex))
    }

    fn dynamic_channels(&mut self, eds: &Eds) -> fmt::Result {
        if eds.dynamic_channels.is_empty() {
            return Ok(());
        }
        self.section("DynamicChannels")?;
        self.entry("NrOfSeg", eds.dynamic_channels.len())?;
        for channel in &eds.dynamic_channels {
            let texts = [
                ("Type", &channel.data_type),
                ("Dir", &channel.direction),
                ("Range", &channel.range),
                ("PPOffset", &channel.offset),
                ("MaxCnt", &channel.max_count),
            ];
            for (key, text) in texts {
                self.said(&format!("{key}{}", channel.number), present(text))?;
            }
        }
        Ok(())
    }

    fn list(&mut self, list: List, objects: &[&Object]) -> fmt::Result {
        self.section(list.section())?;
        self.entry("SupportedObjects", objects.len())?;
        (1..).zip(objects).try_for_each(|(number, object)| writeln!(self.text, "{number}=0x{:04X}", object.index))
    }

    fn object(&mut self, object: &Object) -> fmt::Result {
        self.section(&format!("{:04X}", object.index))?;
        self.entry("ParameterName", one_line(&object.name))?;
        writeln!(self.text, "ObjectType=0x{:X}", object.object_type.code())?;
        let single = object.variables.first().filter(|_| !object.object_type.has_sub_objects());
        if let Some(variable) = single.filter(|_| object.variables.len() == 1) {
            self.variable(object.index, variable)?;
            return self.flags(object.flags | variable.flags);
        }
        self.entry("SubNumber", object.variables.len())?;
        self.flags(object.flags)?;
        for variable in &object.variables {
            self.section(&format!("{:04X}sub{:X}", object.index, variable.sub_index))?;
            self.entry("ParameterName", one_line(&variable.name))?;
            writeln!(self.text, "ObjectType=0x{:X}", if variable.is_domain { 2 } else { 7 })?;
            self.variable(object.index, variable)?;
            self.flags(variable.flags)?;
        }
        Ok(())
    }

    fn variable(&mut self, index: u16, variable: &Variable) -> fmt::Result {
        let value = |value: &Option<Value>| value.as_ref().map(|value| value.in_file(index, variable.data_type));
        writeln!(self.text, "DataType=0x{:04X}", variable.data_type.0)?;
        self.said("LowLimit", value(&variable.low))?;
        self.said("HighLimit", value(&variable.high))?;
        self.entry("AccessType", variable.access.name())?;
        self.said("DefaultValue", value(&variable.default))?;
        self.entry("PDOMapping", u8::from(variable.pdo_mapping))?;
        self.said("ParameterValue", value(&variable.value))?;
        self.said("Denotation", present(&variable.denotation))?;
        self.said("UploadFile", present(&variable.upload_file))?;
        self.said("DownloadFile", present(&variable.download_file))
    }

    fn flags(&mut self, flags: u32) -> fmt::Result {
        self.said("ObjFlags", Some(Hex(flags)).filter(|_| flags != 0))
    }

    fn kept(&mut self, section: &KeptSection) -> fmt::Result {
        self.section(&one_line(&section.name))?;
        section.entries.iter().try_for_each(|(key, value)| self.entry(&one_line(key), one_line(value)))
    }
}

struct Hex(u32);

impl fmt::Display for Hex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:X}", self.0)
    }
}

fn present(text: &str) -> Option<String> {
    (!text.is_empty()).then(|| one_line(text))
}

/// A text as one line that a reader takes.
fn one_line(text: &str) -> String {
    const MOST_LETTERS: usize = 1_000;
    let plain = |letter| match letter {
        '\t' => ' ',
        letter if char::is_control(letter) => '?',
        letter => letter,
    };
    text.chars().take(MOST_LETTERS).map(plain).collect::<String>().trim().to_owned()
}

impl Value {
    /// As a file has it: identifiers and mapping records, which are of the communication profile and 32 bits wide, in
    /// hexadecimal.
    pub fn in_file(&self, index: u16, data_type: TypeCode) -> String {
        match self {
            Self::Number(Number { base, plus_node_id: false })
                if data_type == TypeCode::UNSIGNED32 && matches!(index, 0x1000..=0x1FFF) && *base > 9 =>
            {
                format!("0x{base:X}")
            }
            Self::Text(text) => one_line(text),
            value => value.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DCF: &str = "[FileInfo]\nFileName=a.dcf\nFileVersion=1\nLastEDS=a.eds\n\
        [DeviceInfo]\nVendorName=V\nVendorNumber=0x100\nBaudRate_500=1\nGranularity=8\nNrOfRXPDO=1\nLSS_Supported=1\nCompactPDO=3\n\
        [DeviceComissioning]\nNodeID=5\nNodeName=Axis\nBaudrate=500\nCANopenManager=0\n\
        [DummyUsage]\nDummy0005=1\n[Comments]\nLines=1\nLine1=by hand\n[DynamicChannels]\nNrOfSeg=1\nType1=7\nDir1=ro\n\
        [MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n\
        [1000]\nParameterName=Device type\nDataType=7\nAccessType=const\nDefaultValue=0x20192\n\
        [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\nPDOMapping=1\n\
        [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n[1018sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
        [1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\nDefaultValue=0x100\n\
        [OptionalObjects]\nSupportedObjects=1\n1=0x1014\n[1014]\nParameterName=COB-ID EMCY\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x80\nParameterValue=0x85\nObjFlags=1\n\
        [ManufacturerObjects]\nSupportedObjects=3\n1=0x2000\n2=0x2001\n3=0x2002\n\
        [2000]\nParameterName=Limits\nDataType=3\nAccessType=rww\nLowLimit=-5\nHighLimit=5\nDefaultValue=-1\nPDOMapping=1\n\
        [2001]\nParameterName=Words\nObjectType=8\nDataType=6\nAccessType=rw\nCompactSubObj=2\n\
        [2002]\nParameterName=Program\nObjectType=2\nDataType=0xF\nAccessType=wo\nDownloadFile=p.bin\n\
        [M1ModuleInfo]\nProductName=DI8\n";

    fn load(text: &str) -> Eds {
        Eds::load(text.as_bytes()).expect("a small file").eds
    }

    /// Without what is about the file and not about the device.
    fn bare(mut eds: Eds) -> Eds {
        eds.kept.iter_mut().for_each(|section| section.line = 0);
        for object in &mut eds.objects {
            (object.line, object.compact) = (0, None);
            object.variables.iter_mut().for_each(|variable| variable.line = 0);
            // Those of a single value stand once in the file.
            if object.variables.len() == 1 && !object.object_type.has_sub_objects() {
                object.flags |= object.variables[0].flags;
                object.variables[0].flags = object.flags;
            }
        }
        eds
    }

    #[test]
    fn what_is_written_reads_as_the_same() {
        let read = load(DCF);
        assert_eq!(bare(load(&write(&read))), bare(read));
    }

    #[test]
    fn what_is_written_has_nothing_wrong_with_it() {
        let written = write(&load(DCF));
        let reading = Eds::load(written.as_bytes()).expect("a small file");
        let whats: Vec<_> = reading.findings.iter().map(|finding| finding.what.as_str()).collect();
        assert_eq!(
            whats,
            ["objects of modules are not read: write those that are plugged in as objects of the device"],
            "{written}"
        );
    }

    #[test]
    fn a_text_of_two_lines_is_written_as_one() {
        let mut eds = load(DCF);
        eds.objects[0].name = "Device\n[2000]".into();
        assert!(write(&eds).contains("ParameterName=Device?[2000]\n"));
    }
}
