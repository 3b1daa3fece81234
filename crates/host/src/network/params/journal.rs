//! The journal of a transaction on the disk, and the way back by it.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use canopen::NodeId;
use master::Drive;
use master::parameters::{Parameters, Undone, roll_back};
use serde::Serialize;

use super::pre_operational::{SeenBy, leave_operational};
use super::source;
use machine::parameters::journal::Journal;
use words::document::read_text;
use words::failure::Failure;
use words::plain;

/// Where the journal of a node is, if no other place is named.
pub fn default_path(node: NodeId) -> PathBuf {
    PathBuf::from(format!("ferrodrive-node{node}.journal"))
}

/// A journal on the disk. One that is dropped stays there; `on_drop` hears of that.
#[derive(Debug)]
pub struct Kept {
    path: PathBuf,
    node: NodeId,
    is_done: bool,
    /// Hears what to do when it is dropped.
    on_drop: fn(&str),
}

impl Kept {
    /// Whether a journal of this node can be kept there, for a caller that writes it later.
    ///
    /// # Errors
    /// There is one already.
    pub fn check_free(path: &Path, node: NodeId) -> Result<(), Failure> {
        // A link that leads nowhere is there as well.
        if path.symlink_metadata().is_ok() { Err(exists(path, node)) } else { Ok(()) }
    }

    /// Writes it, whole and onto the disk itself, before anything is written to the node.
    ///
    /// # Errors
    /// There is one already, or it cannot be written.
    pub fn create(path: &Path, journal: &Journal, on_drop: fn(&str)) -> Result<Self, Failure> {
        let file = OpenOptions::new().write(true).create_new(true).open(path);
        let mut file = match file {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Err(exists(path, journal.node)),
            Err(error) => return Err(Failure::of_writing("the journal", path, &error)),
        };
        let written = file.write_all(journal.print().as_bytes()).and_then(|()| file.sync_all());
        written.and_then(|()| sync_folder(path)).map_err(|error| Failure::of_writing("the journal", path, &error))?;
        Ok(Self { path: path.to_owned(), node: journal.node, is_done: false, on_drop })
    }

    /// Deletes it: the node is as it should be, or as it was.
    ///
    /// # Errors
    /// It cannot be deleted.
    pub fn remove(mut self) -> Result<(), Failure> {
        self.is_done = true;
        remove(&self.path)
    }
}

/// The program ends before the transaction does: by a signal, or because the bus has gone.
impl Drop for Kept {
    fn drop(&mut self) {
        if !self.is_done {
            (self.on_drop)(&format!(
                "the writes to node {} were not completed; to undo them: ferrodrive params rollback {0} {}",
                self.node,
                plain(&self.path.display().to_string())
            ));
        }
    }
}

fn exists(path: &Path, node: NodeId) -> Failure {
    Failure::new(format!("{} is there already; nothing was written", path.display()))
        .of_kind("journal_exists")
        .at_node(node)
        .because("an earlier apply was not completed, or one is running now")
        .next(format!("undo it first: ferrodrive params rollback {node} {}", path.display()))
        .next("or delete that file to keep the node as it is")
}

fn remove(path: &Path) -> Result<(), Failure> {
    std::fs::remove_file(path).map_err(|error| {
        Failure::new(format!("cannot delete the journal {}", path.display()))
            .because(error)
            .next("delete it by hand: a rollback with it would write what the node had before")
    })
}

/// A new name in a folder is on the disk when the folder is. Not every system lets a folder be opened.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match File::open(folder) {
        Ok(folder) => folder.sync_all(),
        Err(_) => Ok(()),
    }
}

/// What a rollback has put back: as many objects as the transaction had changed.
#[derive(Debug, Serialize)]
pub struct RollbackReport {
    /// Its node-ID.
    pub node: u8,
    /// The journal, which is deleted.
    pub journal: String,
    /// Objects that have again what they had.
    pub put_back: usize,
    /// By what the node was seen to be pre-operational again; `None` where it was not started.
    pub nmt_back: Option<&'static str>,
    /// The same in words.
    #[serde(skip)]
    pub nmt_back_in_words: Option<&'static str>,
}

/// Puts back what a node had before a transaction that was broken off.
///
/// # Errors
/// The journal is not there, is not readable or is of another node; the drive is at work; not everything could be put back.
pub async fn roll_back_by(path: &Path, drive: &Drive) -> Result<RollbackReport, Failure> {
    let node = drive.node().id();
    let journal = read(path, node)?;
    let meant = Parameters { identity: journal.identity, ..Parameters::default() };
    // A plan of nothing compares the identities.
    drive.plan_parameters(&meant, Default::default()).await.map_err(source::refused)?;
    drive.check_at_rest().await.map_err(source::refused)?;
    let undone = roll_back(drive.node(), &journal.undo, |_| None).await;
    if !undone.not_put_back.is_empty() {
        return Err(not_put_back(node, &undone, path));
    }
    let seen = match journal.pre_operational {
        true => leave_operational(drive, None).await.ok(),
        false => None,
    };
    remove(path)?;
    Ok(RollbackReport {
        node: node.raw(),
        journal: path.display().to_string(),
        put_back: undone.put_back,
        nmt_back: seen.map(SeenBy::word),
        nmt_back_in_words: seen.map(SeenBy::words),
    })
}

/// That some objects have not what they had.
pub fn not_put_back(node: NodeId, undone: &Undone, path: &Path) -> Failure {
    let failure = Failure::new(format!("not everything of node {node} could be put back")).of_kind("not_put_back");
    let failure = undone.not_put_back.iter().fold(failure.at_node(node), |failure, left| {
        let had = machine::parameters::hexadecimal(&left.had);
        failure.because(format!("{} had {had}, {}", left.object, left.why))
    });
    failure.next(format!("when it answers again: ferrodrive params rollback {node} {}", path.display()))
}

/// Reads a journal of a node.
///
/// # Errors
/// It is not there, is not readable, or is of another node.
pub fn read(path: &Path, node: NodeId) -> Result<Journal, Failure> {
    if !path.exists() {
        return Err(Failure::new(format!("there is no journal {}", path.display()))
            .of_kind("no_journal")
            .at_node(node)
            .because("every apply to this node from this folder was completed, or its journal is another file")
            .next("name the journal, or write parameters that were kept: ferrodrive params apply NODE FILE"));
    }
    let unusable = |reason: String| {
        Failure::new(format!("cannot read {} as a journal; nothing was written", path.display()))
            .of_kind("bad_journal")
            .because(reason)
            .next("an apply that was interrupted while it wrote its journal had not written to the node: then delete the file")
    };
    let text = read_text(path).map_err(unusable)?;
    let journal = Journal::parse(&text).map_err(|bad| unusable(bad.named(path.display().to_string()).to_string()))?;
    if journal.node != node {
        return Err(Failure::bad_file(format!(
            "{} belongs to node {}, not to node {node}",
            path.display(),
            journal.node
        ))
        .next(format!("ferrodrive params rollback {} {}", journal.node, path.display())));
    }
    Ok(journal)
}
