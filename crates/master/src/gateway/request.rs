//! A line of a client: `"[" sequence "]" [[net] node] command`, words in any case, `#` before a comment.

use canopen::Mux;

use super::data_type::{GatewayType, unsigned};
use super::refusal::Refusal;

/// A line that was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct GatewayRequest {
    /// The client's number for it, which the answer repeats.
    pub sequence: u32,
    /// Numbers before the command: none, a node (of some commands a network), or a network and a node.
    pub place: Vec<u64>,
    /// What to do.
    pub command: GatewayCommand,
}

/// What a client asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum GatewayCommand {
    /// `r[ead] INDEX SUB TYPE`: SDO upload.
    Read(Mux, GatewayType),
    /// `w[rite] INDEX SUB TYPE VALUE`: SDO download.
    Write(Mux, Vec<u8>),
    /// `set sdo_timeout MS`.
    SetSdoTimeout(u32),
    /// `start`.
    Start,
    /// `stop`.
    Stop,
    /// `preop[erational]`.
    PreOperational,
    /// `reset node`.
    ResetNode,
    /// `reset comm[unication]`.
    ResetCommunication,
    /// `enable heartbeat MS`: watch a node's heartbeat.
    WatchHeartbeat(u32),
    /// `disable heartbeat`.
    ForgetHeartbeat,
    /// `set heartbeat MS`: the gateway's own, 0 for none.
    SetHeartbeat(u32),
    /// `set id NODE`: the gateway's own node-ID.
    SetId(u64),
    /// `set network NET`: the default.
    SetNetwork(u64),
    /// `set node NODE`: the default.
    SetNode(u64),
    /// `boot_up_indication enable|disable`.
    BootUpIndication(bool),
    /// `info version`.
    InfoVersion,
    /// `set rpdo NUMBER COB-ID TRANSMISSION COUNT TYPE..`: report such PDOs.
    SetRpdo(u64, u64, Vec<GatewayType>),
    /// `set tpdo NUMBER COB-ID TRANSMISSION COUNT TYPE..`: PDOs to be sent.
    SetTpdo(u64, u64, Vec<GatewayType>),
    /// `r[ead] p[do] NUMBER`: the last such PDO.
    ReadPdo(u64),
    /// `w[rite] p[do] NUMBER COUNT VALUE..`.
    WritePdo(u64, Vec<String>),
    /// A command of CiA 309-3 that this gateway does not have.
    NotSupported,
}

/// A line that was not understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unreadable {
    /// The client's number for it, 0 where it has none.
    pub sequence: u32,
    /// The error of CiA 309-3 that answers it.
    pub refusal: Refusal,
}

/// Commands of the standard that are not supported: node guarding, LSS, choice of the bit rate and others, by their first
/// words.
const NOT_SUPPORTED: [&[&str]; 10] = [
    &["enable", "guarding"],
    &["disable", "guarding"],
    &["init"],
    &["set", "command_timeout"],
    &["set", "command_size"],
    &["set", "sdo_block"],
    &["log"],
    &["lss"],
    &["_lss"],
    &["help"],
];

impl GatewayRequest {
    /// Reads a line; `None` for an empty one or a comment.
    ///
    /// # Errors
    /// The code to answer with, under the line's number where it has one.
    pub fn parse(line: &str) -> Result<Option<Self>, Unreadable> {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return Ok(None);
        }
        let unnumbered = Unreadable { sequence: 0, refusal: Refusal::SYNTAX };
        let (number, rest) = line.strip_prefix('[').and_then(|rest| rest.split_once(']')).ok_or(unnumbered)?;
        let sequence = unsigned(number.trim()).and_then(|number| u32::try_from(number).ok()).ok_or(unnumbered)?;
        let refused = |refusal| Unreadable { sequence, refusal };
        let words = words(rest).ok_or(refused(Refusal::SYNTAX))?;
        if words.is_empty() {
            return Ok(None);
        }
        let numbers = words.iter().take_while(|word| word.starts_with(|first: char| first.is_ascii_digit())).count();
        let place: Option<Vec<u64>> = words[..numbers].iter().map(|word| unsigned(word)).collect();
        let place = place.filter(|place| place.len() <= 2).ok_or(refused(Refusal::SYNTAX))?;
        let command = command(&words[numbers..]).ok_or(refused(Refusal::SYNTAX))?;
        Ok(Some(Self { sequence, place, command }))
    }
}

/// Splits a line at spaces, up to a comment. Quotes hold a word together; doubled they stand for one. `None` if a quote is not
/// closed.
fn words(line: &str) -> Option<Vec<String>> {
    let mut words: Vec<String> = Vec::new();
    let mut chars = line.chars().peekable();
    while let Some(char) = chars.next() {
        match char {
            '#' => break,
            _ if char.is_whitespace() => {}
            '"' => {
                let mut word = String::new();
                loop {
                    match chars.next()? {
                        '"' if chars.next_if_eq(&'"').is_some() => word.push('"'),
                        '"' => break,
                        other => word.push(other),
                    }
                }
                words.push(word);
            }
            _ => {
                let mut word = String::from(char);
                while let Some(next) = chars.next_if(|next| !next.is_whitespace() && *next != '#') {
                    word.push(next);
                }
                words.push(word);
            }
        }
    }
    Some(words)
}

/// `None` is a syntax error.
fn command(words: &[String]) -> Option<GatewayCommand> {
    let lower: Vec<String> = words.iter().map(|word| word.to_ascii_lowercase()).collect();
    let lower: Vec<&str> = lower.iter().map(String::as_str).collect();
    let number = |word: &str| unsigned(word).and_then(|number| u32::try_from(number).ok());
    Some(match lower.as_slice() {
        ["r" | "read", "p" | "pdo", nr] => GatewayCommand::ReadPdo(unsigned(nr)?),
        ["w" | "write", "p" | "pdo", nr, count, ..] => {
            let values = words[4..].to_vec();
            (unsigned(count)? == values.len() as u64).then_some(GatewayCommand::WritePdo(unsigned(nr)?, values))?
        }
        ["r" | "read", index, sub, kind] => GatewayCommand::Read(mux(index, sub)?, GatewayType::named(kind)?),
        ["w" | "write", index, sub, kind, _value] => {
            // The value as it was typed: a text has capitals.
            GatewayCommand::Write(mux(index, sub)?, GatewayType::named(kind)?.bytes(words.last()?)?)
        }
        ["start"] => GatewayCommand::Start,
        ["stop"] => GatewayCommand::Stop,
        ["preop" | "preoperational"] => GatewayCommand::PreOperational,
        ["reset", "node"] => GatewayCommand::ResetNode,
        ["reset", "comm" | "communication"] => GatewayCommand::ResetCommunication,
        ["enable", "heartbeat", time] => GatewayCommand::WatchHeartbeat(number(time)?),
        ["disable", "heartbeat"] => GatewayCommand::ForgetHeartbeat,
        ["set", "heartbeat", time] => GatewayCommand::SetHeartbeat(number(time)?),
        ["set", "id", node] => GatewayCommand::SetId(unsigned(node)?),
        ["set", "network", net] => GatewayCommand::SetNetwork(unsigned(net)?),
        ["set", "node", node] => GatewayCommand::SetNode(unsigned(node)?),
        ["set", "sdo_timeout", time] => GatewayCommand::SetSdoTimeout(number(time).filter(|time| *time > 0)?),
        ["boot_up_indication", "enable"] => GatewayCommand::BootUpIndication(true),
        ["boot_up_indication", "disable"] => GatewayCommand::BootUpIndication(false),
        ["info", "version"] => GatewayCommand::InfoVersion,
        ["set", "rpdo", nr, cob, _transmission, count, types @ ..] => {
            let types = pdo_types(count, types)?;
            GatewayCommand::SetRpdo(unsigned(nr)?, unsigned(cob)?, types)
        }
        ["set", "tpdo", nr, cob, _transmission, count, types @ ..] => {
            let types = pdo_types(count, types)?;
            GatewayCommand::SetTpdo(unsigned(nr)?, unsigned(cob)?, types)
        }
        [first, ..] => {
            let known = |row: &&[&str]| match row {
                [one] => first.starts_with(one),
                row => lower.starts_with(row),
            };
            return NOT_SUPPORTED.iter().any(known).then_some(GatewayCommand::NotSupported);
        }
        [] => return None,
    })
}

/// So many types, each of a fixed length.
fn pdo_types(count: &str, types: &[&str]) -> Option<Vec<GatewayType>> {
    let types: Option<Vec<GatewayType>> = types.iter().map(|name| GatewayType::named(name)).collect();
    let types = types.filter(|types| types.iter().all(|kind| kind.size().is_some()))?;
    (unsigned(count)? == types.len() as u64 && !types.is_empty()).then_some(types)
}

fn mux(index: &str, sub: &str) -> Option<Mux> {
    let index = unsigned(index).and_then(|index| u16::try_from(index).ok())?;
    let sub = unsigned(sub).and_then(|sub| u8::try_from(sub).ok())?;
    Some(Mux::new(index, sub))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_in_any_case_with_or_without_a_place() {
        let read = |index, kind| GatewayCommand::Read(Mux::new(index, 0), kind);
        for (line, place, command) in [
            ("[1] 4 r 0x1000 0 u32", vec![4], read(0x1000, GatewayType::Unsigned(4))),
            ("[ 1 ] 1 4 READ 4096 0x00 X32  # device type", vec![1, 4], read(0x1000, GatewayType::Hexadecimal(4))),
            ("[1] r 0x1008 0 vs\r\n", vec![], read(0x1008, GatewayType::VisibleString)),
            ("[1] 4 w 0x6040 0 u16 6", vec![4], GatewayCommand::Write(Mux::new(0x6040, 0), vec![6, 0])),
            (
                "[1] 4 write 0x2000 1 vs \"A \"\"b\"\"\"",
                vec![4],
                GatewayCommand::Write(Mux::new(0x2000, 1), b"A \"b\"".to_vec()),
            ),
            ("[1] 0 start", vec![0], GatewayCommand::Start),
            ("[1] 4 preop", vec![4], GatewayCommand::PreOperational),
            ("[1] 4 reset communication", vec![4], GatewayCommand::ResetCommunication),
            ("[1] set node 4", vec![], GatewayCommand::SetNode(4)),
            ("[1] 4 enable guarding 100 3", vec![4], GatewayCommand::NotSupported),
            ("[1] lss_scan", vec![], GatewayCommand::NotSupported),
            (
                "[1] set rpdo 1 0x184 event 2 u16 i32",
                vec![],
                GatewayCommand::SetRpdo(1, 0x184, vec![GatewayType::Unsigned(2), GatewayType::Integer(4)]),
            ),
        ] {
            assert_eq!(GatewayRequest::parse(line), Ok(Some(GatewayRequest { sequence: 1, place, command })), "{line}");
        }
        for line in ["", "   ", "# a comment", "[7]", "[7] # nothing"] {
            assert_eq!(GatewayRequest::parse(line), Ok(None), "{line}");
        }
    }

    #[test]
    fn what_is_no_command_is_a_syntax_error_under_its_number() {
        for (line, sequence) in [
            ("r 0x1000 0 u32", 0),
            ("[] start", 0),
            ("[-1] start", 0),
            ("[4294967296] start", 0),
            ("[1 start", 0),
            ("[5] dance", 5),
            ("[5] 4", 5),
            ("[5] 1 2 3 start", 5),
            ("[5] 4x start", 5),
            ("[5] start now", 5),
            ("[5] r 0x1000 0", 5),
            ("[5] r 0x1000 0 u33", 5),
            ("[5] r 0x10000 0 u32", 5),
            ("[5] r 0x1000 256 u32", 5),
            ("[5] w 0x6040 0 u16", 5),
            ("[5] w 0x6040 0 u16 65536", 5),
            ("[5] w 0x6040 0 u16 6 7", 5),
            ("[5] w 0x2000 0 vs \"open", 5),
            ("[5] set rpdo 1 0x184 event 3 u16", 5),
            ("[5] set rpdo 1 0x184 event 1 vs", 5),
            ("[5] w p 1 2 1", 5),
            ("[5] set sdo_timeout 0", 5),
        ] {
            let refused = Unreadable { sequence, refusal: Refusal::SYNTAX };
            assert_eq!(GatewayRequest::parse(line), Err(refused), "{line}");
        }
    }
}
