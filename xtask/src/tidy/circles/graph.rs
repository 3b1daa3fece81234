//! Which file names what of which other, and the circles among them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::modules::Tree;
use super::resolve::Resolved;

/// The files of a crate and who names whom.
pub(super) struct Graph {
    files: Vec<String>,
    /// By the file that names and the one that defines; the first place of each pair.
    edges: BTreeMap<(usize, usize), Edge>,
}

/// One file names something that another defines.
#[derive(Debug, Clone)]
pub(super) struct Edge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) line: usize,
    pub(super) name: String,
}

impl Graph {
    /// The first edge of each pair counts.
    pub(super) fn new(files: Vec<String>, edges: impl IntoIterator<Item = Edge>) -> Self {
        let mut graph = Self { files, edges: BTreeMap::new() };
        edges.into_iter().for_each(|edge| graph.join(edge));
        graph
    }

    pub(super) fn of(tree: &Tree) -> Self {
        let mut graph = Self::new(tree.files.clone(), []);
        for module in 0..tree.modules.len() {
            graph.add_imports(tree, module);
            for (path, line) in &tree.modules[module].paths {
                graph.add(tree, module, *line, tree.resolve(module, path));
            }
            for (name, line) in &tree.modules[module].calls {
                let written = tree.macros.get(name).map(|at| Resolved::Item(*at, name.clone()));
                graph.add(tree, module, *line, written);
            }
        }
        graph
    }

    /// An import that is only passed on does not count, nor does that of a module: what is named through it does.
    fn add_imports(&mut self, tree: &Tree, module: usize) {
        let inside = &tree.modules[module];
        for import in &inside.imports {
            match &import.alias {
                Some(alias) if import.passed_on && !inside.names.contains(alias) => {}
                Some(_) => self.add(tree, module, import.line, tree.resolve(module, &import.path)),
                None => {
                    let Some(Resolved::Module(from)) = tree.resolve(module, &import.path) else { continue };
                    for name in &inside.names {
                        if !inside.defined.contains(name) && !inside.children.contains_key(name) {
                            let found = tree.resolve(from, &["self".to_owned(), name.clone()]);
                            let is_there = |found: &Resolved| tree.defines(found);
                            self.add(tree, module, import.line, found.filter(is_there));
                        }
                    }
                }
            }
        }
    }

    fn add(&mut self, tree: &Tree, module: usize, line: usize, found: Option<Resolved>) {
        let Some(Resolved::Item(owner, name)) = found else { return };
        let (from, to) = (tree.modules[module].file, tree.modules[owner].file);
        if from != to {
            self.join(Edge { from, to, line, name });
        }
    }

    fn join(&mut self, edge: Edge) {
        self.edges.entry((edge.from, edge.to)).or_insert(edge);
    }

    pub(super) fn file(&self, place: usize) -> &str {
        &self.files[place]
    }

    /// The strongly connected parts of more than one file, each in the files' order.
    pub(super) fn circles(&self) -> Vec<Vec<usize>> {
        let reach: Vec<BTreeSet<usize>> = (0..self.files.len()).map(|file| self.reached_from(file)).collect();
        let mut taken = BTreeSet::<usize>::new();
        let mut circles = Vec::new();
        for file in 0..self.files.len() {
            if taken.contains(&file) || !reach[file].contains(&file) {
                continue;
            }
            let members: Vec<usize> =
                reach[file].iter().copied().filter(|other| reach[*other].contains(&file)).collect();
            taken.extend(&members);
            circles.push(members);
        }
        circles
    }

    fn next(&self, file: usize) -> impl Iterator<Item = &Edge> {
        self.edges.range((file, 0)..(file + 1, 0)).map(|(_, edge)| edge)
    }

    /// All files that a file needs, itself only by way of others.
    fn reached_from(&self, file: usize) -> BTreeSet<usize> {
        let mut reached = BTreeSet::new();
        let mut open = vec![file];
        while let Some(at) = open.pop() {
            open.extend(self.next(at).map(|edge| edge.to).filter(|to| reached.insert(*to)));
        }
        reached
    }

    /// The shortest circle among the members; of several, the one whose first file's path comes first.
    pub(super) fn shortest_way_round(&self, members: &[usize]) -> Vec<&Edge> {
        let mut sorted = members.to_vec();
        sorted.sort_by_key(|file| self.file(*file));
        let ways = sorted.iter().filter_map(|file| self.way_back_to(*file));
        ways.min_by_key(Vec::len).unwrap_or_default()
    }

    fn way_back_to(&self, file: usize) -> Option<Vec<&Edge>> {
        let mut came_by: BTreeMap<usize, &Edge> = BTreeMap::new();
        let mut open = VecDeque::from([file]);
        while let Some(at) = open.pop_front() {
            for edge in self.next(at) {
                if came_by.contains_key(&edge.to) {
                    continue;
                }
                came_by.insert(edge.to, edge);
                if edge.to == file {
                    let mut way = vec![edge];
                    while way[way.len() - 1].from != file {
                        way.push(came_by[&way[way.len() - 1].from]);
                    }
                    way.reverse();
                    return Some(way);
                }
                open.push_back(edge.to);
            }
        }
        None
    }
}

impl Tree {
    /// Whether an item's module is seen to define it.
    fn defines(&self, found: &Resolved) -> bool {
        matches!(found, Resolved::Item(module, name) if self.modules[*module].defined.contains(name))
    }
}
