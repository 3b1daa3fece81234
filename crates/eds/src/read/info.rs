//! The sections that are about the file and the device as a whole.

use super::places::{Info, is_about_modules};
use super::reader::{Reader, shortened};
use crate::Rule;
use crate::document::{Entry, Section};
use crate::{BIT_RATES, DynamicChannel, KeptSection, TypeCode};

/// Dynamic channels that are read: CiA 302 networks have a handful.
const MOST_CHANNELS: usize = 256;

/// The finding at each section about modules.
const MODULES: &str = "objects of modules are not read: write those that are plugged in as objects of the device";

impl Reader {
    pub(super) fn info(&mut self, which: Info, section: Section<'_>) {
        for entry in self.entries(section) {
            let known = match which {
                Info::File => self.file_info(section, entry),
                Info::Device => self.device_info(section, entry),
                Info::Dummies => self.dummy(section, entry),
                Info::Comments => self.comment(entry),
                Info::Commissioning => self.commissioning(section, entry),
                Info::DynamicChannels => self.dynamic_channel(entry),
            };
            if !known {
                self.found(Rule::UnknownKey, section, entry, "CiA 306 has no such key here", "nothing");
            }
        }
        if which == Info::Commissioning {
            self.eds.commissioning.get_or_insert_default();
        }
    }

    /// Sections about modules, and sections of a vendor's own.
    pub(super) fn keep(&mut self, section: Section<'_>) {
        let (what, taken) = if is_about_modules(section.name()) {
            (MODULES, "the device without modules; the section is kept as it is")
        } else {
            ("CiA 306 has no such section", "nothing; it is kept as it is")
        };
        self.found_in(Rule::UnknownSection, section, what, taken);
        let entries = section.entries().map(|entry| (entry.key.to_owned(), entry.value.to_owned())).collect();
        self.eds.kept.push(KeptSection { line: section.line(), name: section.name().to_owned(), entries });
    }

    fn file_info(&mut self, section: Section<'_>, entry: Entry<'_>) -> bool {
        let file = &mut self.eds.file;
        let text = match entry.key.to_ascii_lowercase().as_str() {
            "fileversion" => {
                self.eds.file.file_version = self.count(section, entry);
                return true;
            }
            "filerevision" => {
                self.eds.file.file_revision = self.count(section, entry);
                return true;
            }
            "filename" => &mut file.file_name,
            "edsversion" => &mut file.eds_version,
            "description" => &mut file.description,
            "creationtime" => &mut file.creation_time,
            "creationdate" => &mut file.creation_date,
            "createdby" => &mut file.created_by,
            "modificationtime" => &mut file.modification_time,
            "modificationdate" => &mut file.modification_date,
            "modifiedby" => &mut file.modified_by,
            "lasteds" => &mut file.last_eds,
            _ => return false,
        };
        entry.value.clone_into(text);
        true
    }

    fn device_info(&mut self, section: Section<'_>, entry: Entry<'_>) -> bool {
        let key = entry.key.to_ascii_lowercase();
        if let Some(rate) = key.strip_prefix("baudrate_") {
            let Some(rate) = rate.parse().ok().filter(|rate| BIT_RATES.contains(rate)) else { return false };
            if self.flag(section, entry) && !self.eds.device.bit_rates.contains(&rate) {
                self.eds.device.bit_rates.push(rate);
                self.eds.device.bit_rates.sort_unstable();
            }
            return true;
        }
        match key.as_str() {
            "vendorname" => entry.value.clone_into(&mut self.eds.device.vendor_name),
            "productname" => entry.value.clone_into(&mut self.eds.device.product_name),
            "ordercode" => entry.value.clone_into(&mut self.eds.device.order_code),
            "vendornumber" => self.eds.device.vendor_number = self.count(section, entry),
            "productnumber" => self.eds.device.product_number = self.count(section, entry),
            "revisionnumber" => self.eds.device.revision_number = self.count(section, entry),
            "simplebootupmaster" => self.eds.device.simple_boot_up_master = self.flag(section, entry),
            "simplebootupslave" => self.eds.device.simple_boot_up_slave = self.flag(section, entry),
            "granularity" => self.eds.device.granularity = self.count(section, entry).unwrap_or(0),
            "dynamicchannelssupported" => {
                self.eds.device.dynamic_channels_supported = self.count(section, entry).unwrap_or(0);
            }
            "groupmessaging" => self.eds.device.group_messaging = self.flag(section, entry),
            "nrofrxpdo" => self.eds.device.rpdos = self.count(section, entry),
            "nroftxpdo" => self.eds.device.tpdos = self.count(section, entry),
            "lss_supported" => self.eds.device.lss = self.flag(section, entry),
            "compactpdo" => {
                self.eds.device.compact_pdo = self.count(section, entry).unwrap_or(0);
                self.compact_pdo_line = entry.line;
            }
            _ => return false,
        }
        true
    }

    /// `Dummy0005=1`: UNSIGNED8 may be mapped as a placeholder.
    fn dummy(&mut self, section: Section<'_>, entry: Entry<'_>) -> bool {
        let code = entry.key.get(..5).filter(|start| start.eq_ignore_ascii_case("dummy"));
        let Some(code) = code.and_then(|_| u16::from_str_radix(&entry.key[5..], 16).ok()) else { return false };
        let allowed = self.flag(section, entry);
        // The types that may stand in a mapping as placeholders have the codes 1 to 1Fh (CiA 301, 7.4.7.1).
        let known = self.eds.dummies.iter_mut().find(|(known, _)| known.0 == code);
        match known {
            Some((_, last)) => *last = allowed,
            None if code < 0x20 => self.eds.dummies.push((TypeCode(code), allowed)),
            None => return false,
        }
        true
    }

    /// `Lines=2`, `Line1=..`: as they stand.
    fn comment(&mut self, entry: Entry<'_>) -> bool {
        if entry.key.eq_ignore_ascii_case("Lines") {
            return true;
        }
        let number = entry.key.get(..4).filter(|start| start.eq_ignore_ascii_case("line"));
        if number.is_none_or(|_| entry.key[4..].parse::<u32>().is_err()) {
            return false;
        }
        self.eds.comments.push(entry.value.to_owned());
        true
    }

    fn commissioning(&mut self, section: Section<'_>, entry: Entry<'_>) -> bool {
        let key = entry.key.to_ascii_lowercase();
        let mut read = self.eds.commissioning.take().unwrap_or_default();
        let mut known = true;
        match key.as_str() {
            "nodeid" => {
                read.node_id = self.count(section, entry).filter(|id| (1..=127).contains(id));
                if read.node_id.is_none() && !entry.value.is_empty() {
                    let what = format!("no node-ID (1 to 127): {:?}", shortened(entry.value));
                    self.found(Rule::NodeId, section, entry, what, "none");
                }
            }
            "nodename" => entry.value.clone_into(&mut read.node_name),
            "noderefd" => entry.value.clone_into(&mut read.node_reference),
            "baudrate" => read.bit_rate = self.count(section, entry),
            "netnumber" => read.net_number = self.count(section, entry),
            "networkname" => entry.value.clone_into(&mut read.network_name),
            "netrefd" => entry.value.clone_into(&mut read.network_reference),
            "canopenmanager" => read.is_manager = self.flag(section, entry),
            "lss_serialnumber" => read.lss_serial_number = self.count(section, entry),
            _ => known = false,
        }
        self.eds.commissioning = Some(read);
        known
    }

    /// `NrOfSeg=1`, `Type1=0x0007`, `Dir1=ro`, `Range1=0xA080-0xA0BF`, `PPOffset1=0`, `MaxCnt1=1`.
    fn dynamic_channel(&mut self, entry: Entry<'_>) -> bool {
        if entry.key.eq_ignore_ascii_case("NrOfSeg") {
            return true;
        }
        let word = entry.key.trim_end_matches(|digit: char| digit.is_ascii_digit());
        let Ok(number) = entry.key[word.len()..].parse::<u16>() else { return false };
        let channels = &mut self.eds.dynamic_channels;
        if usize::from(number) > MOST_CHANNELS {
            return false;
        }
        let at = channels.iter().position(|channel| channel.number == number).unwrap_or_else(|| {
            let [data_type, direction, range, offset, max_count] = Default::default();
            channels.push(DynamicChannel { number, data_type, direction, range, offset, max_count });
            channels.len() - 1
        });
        let channel = &mut channels[at];
        let text = match word.to_ascii_lowercase().as_str() {
            "type" => &mut channel.data_type,
            "dir" => &mut channel.direction,
            "range" => &mut channel.range,
            "ppoffset" => &mut channel.offset,
            "maxcnt" => &mut channel.max_count,
            _ => return false,
        };
        entry.value.clone_into(text);
        true
    }
}
