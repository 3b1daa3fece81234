//! From a name to the module that defines it.

use super::modules::Tree;

/// What a path leads to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Resolved {
    Module(usize),
    /// An item, by the module that defines it.
    Item(usize, String),
}

/// No chain of re-exports is as long as this, but a circle of them would be.
const LONGEST_CHAIN: u8 = 32;

impl Tree {
    /// Follows a path as it is written in `module`. `None` for another crate's.
    pub(super) fn resolve(&self, module: usize, path: &[String]) -> Option<Resolved> {
        self.follow(module, path, LONGEST_CHAIN)
    }

    fn follow(&self, module: usize, path: &[String], patience: u8) -> Option<Resolved> {
        let patience = patience.checked_sub(1)?;
        let (first, mut rest) = path.split_first()?;
        let mut here = match first.as_str() {
            "crate" => Resolved::Module(self.root_of(module)),
            "self" => Resolved::Module(module),
            "super" => Resolved::Module(self.modules[module].parent?),
            name => self.name_in(module, name, patience)?,
        };
        while let (Resolved::Module(at), Some((next, after))) = (&here, rest.split_first()) {
            here = match next.as_str() {
                "super" => Resolved::Module(self.modules[*at].parent?),
                // A name without a definition may come from a macro: it belongs to the module.
                name => self.name_in(*at, name, patience).unwrap_or_else(|| Resolved::Item(*at, name.to_owned())),
            };
            rest = after;
        }
        Some(here)
    }

    fn root_of(&self, module: usize) -> usize {
        self.modules[module].parent.map_or(module, |parent| self.root_of(parent))
    }

    /// What a single name means in a module: a child, an item, or something imported.
    fn name_in(&self, module: usize, name: &str, patience: u8) -> Option<Resolved> {
        let inside = &self.modules[module];
        if inside.defined.contains(name) {
            return Some(Resolved::Item(module, name.to_owned()));
        }
        if let Some(child) = inside.children.get(name) {
            return Some(Resolved::Module(*child));
        }
        let imported = inside.imports.iter().filter(|import| import.alias.as_deref() == Some(name));
        let mut imported = imported.filter_map(|import| self.follow_import(module, &import.path, patience));
        imported.next().or_else(|| self.name_by_glob(module, name, patience))
    }

    fn name_by_glob(&self, module: usize, name: &str, patience: u8) -> Option<Resolved> {
        let patience = patience.checked_sub(1)?;
        let globs = self.modules[module].imports.iter().filter(|import| import.alias.is_none());
        let mut found = globs.filter_map(|glob| match self.follow_import(module, &glob.path, patience)? {
            Resolved::Module(from) if from != module => self.name_in(from, name, patience),
            _ => None,
        });
        found.next()
    }

    /// An import's own name does not resolve to itself: `use a::a;`.
    fn follow_import(&self, module: usize, path: &[String], patience: u8) -> Option<Resolved> {
        let patience = patience.checked_sub(1)?;
        match path.first()?.as_str() {
            "crate" | "self" | "super" => self.follow(module, path, patience),
            name if self.modules[module].children.contains_key(name) => self.follow(module, path, patience),
            name => {
                let mut others = self.modules[module].imports.iter().filter(|import| {
                    import.alias.as_deref() == Some(name) && import.path.first().is_some_and(|first| first != name)
                });
                let other = others.next()?;
                let path: Vec<String> = other.path.iter().chain(&path[1..]).cloned().collect();
                self.follow(module, &path, patience)
            }
        }
    }
}
