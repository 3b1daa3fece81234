//! Plays the conversations of `tests/conversations` with virtual drives and compares what is heard, line by line.

use std::collections::VecDeque;
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

use can::Frame;
use ferrodrive_tests::bench::zlac8030l::Bench;
use sim::command;

/// An answer comes within this time.
const ANSWER_WITHIN: Duration = Duration::from_millis(20);
const LOOK_EVERY: Duration = Duration::from_micros(100);

#[test]
fn every_conversation_goes_as_it_is_written() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("conversations");
    let mut files: Vec<_> = std::fs::read_dir(&directory)
        .expect("the conversations")
        .flat_map(|model| model.expect("an entry").path().read_dir().into_iter().flatten())
        .map(|file| file.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "can"))
        .collect();
    files.sort();
    assert!(files.len() >= 13, "{} conversations", files.len());
    let differs = |path: &std::path::PathBuf| {
        let text = std::fs::read_to_string(path).expect("a text");
        let name = path.strip_prefix(&directory).unwrap_or(path).display().to_string();
        hold(&name, &text).err()
    };
    let different: Vec<_> = files.iter().filter_map(differs).collect();
    assert!(different.is_empty(), "\n{}", different.join("\n"));
}

#[test]
fn a_line_that_differs_is_shown_with_its_neighbours_and_what_came_instead() {
    let text =
        "# Device type.\ndrive zlac8030l 4\n> 604#4000100000000000\n< 584#4300100092010200  another type\n# end\n";
    let reported = hold("wrong.can", text).expect_err("the drive says 00040192h");
    let expected = [
        "wrong.can:4: heard 584#4300100092010400",
        "   2   drive zlac8030l 4",
        "   3   > 604#4000100000000000",
        "   4 * < 584#4300100092010200  another type",
        "   5   # end",
    ];
    assert_eq!(reported.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn silence_and_surplus_are_differences_too() {
    let header = "drive zlac8030l 4\n";
    let reported = |lines: &str| hold("x.can", &format!("{header}{lines}")).expect_err("a difference");
    assert!(reported("< 704#00\n").starts_with("x.can:2: heard nothing"));
    assert!(reported("> 604#4000100000000000\n+ 5 ms\n+ 5 ms\n").starts_with("x.can:4: unexpected 584#"));
    assert!(reported("> 604#4000100000000000\n+ 5 ms\n").starts_with("x.can:3: unexpected 584#"));
    assert!(reported("> 604#4000100000000000\n< 584#43001000........  1..2\n").starts_with("x.can:3: heard 262546"));
    assert!(reported("hello\n").starts_with("x.can:2: "));
}

/// Plays one file.
fn hold(name: &str, text: &str) -> Result<(), String> {
    let mut stage = None;
    let lines: Vec<_> = text.lines().collect();
    let last = lines.len();
    for (n, line) in lines.iter().enumerate() {
        play(&mut stage, line).map_err(|what| located(name, &lines, n, &what))?;
    }
    let surplus = stage.as_mut().map_or(Ok(()), Stage::expect_silence);
    surplus.map_err(|what| located(name, &lines, last.saturating_sub(1), &what))
}

fn located(name: &str, lines: &[&str], n: usize, what: &str) -> String {
    let mut text = format!("{name}:{}: {what}\n", n + 1);
    let around = n.saturating_sub(3)..(n + 3).min(lines.len());
    for shown in around.filter(|shown| n.abs_diff(*shown) <= 2) {
        let mark = if shown == n { '*' } else { ' ' };
        let _ = writeln!(text, "  {:2} {mark} {}", shown + 1, lines[shown]);
    }
    text
}

fn play(stage: &mut Option<Stage>, line: &str) -> Result<(), String> {
    let (mark, rest) = line.split_once(' ').unwrap_or((line, ""));
    if line.is_empty() || mark == "#" {
        return Ok(());
    }
    let Some(stage) = stage else {
        *stage = Some(Stage::from_header(line)?);
        return Ok(());
    };
    match mark {
        "<" => return stage.hear(rest),
        ">" | "+" | "!" => stage.expect_silence()?,
        _ => return Err(format!("a line begins with one of # > < + !, not with {mark:?}")),
    }
    match mark {
        ">" => stage.send(rest),
        "+" => stage.wait(rest),
        _ => stage.command(rest),
    }
}

struct Stage {
    bench: Bench,
    heard: VecDeque<Frame>,
}

impl Stage {
    fn from_header(line: &str) -> Result<Self, String> {
        if line != "drive zlac8030l 4" {
            return Err(format!("expected the header \"drive zlac8030l 4\", not {line:?}"));
        }
        let mut bench = Bench::new();
        bench.forget();
        Ok(Self { bench, heard: VecDeque::new() })
    }

    fn run(&mut self, duration: Duration) {
        self.heard.extend(self.bench.run(duration).heard_at().into_iter().map(|(_, frame)| frame));
    }

    fn expect_silence(&mut self) -> Result<(), String> {
        self.heard.pop_front().map_or(Ok(()), |frame| Err(format!("unexpected {frame}")))
    }

    fn send(&mut self, text: &str) -> Result<(), String> {
        let frame = first_word(text).parse().map_err(|_| format!("{text:?} is not a frame"))?;
        self.bench.world.send(self.bench.host, frame).map_err(|error| error.to_string())?;
        // As long as a frame takes, and a little for the drive.
        self.run(Duration::from_micros(300));
        Ok(())
    }

    fn wait(&mut self, text: &str) -> Result<(), String> {
        let ms = text.strip_suffix(" ms").and_then(|ms| ms.parse().ok()).ok_or("expected a time like + 500 ms")?;
        self.run(Duration::from_millis(ms));
        Ok(())
    }

    fn command(&mut self, text: &str) -> Result<(), String> {
        let answer = command::answer(&mut self.bench.world, text).ok_or("expected a command")?;
        if answer.json.contains("\"ok\":true") { Ok(()) } else { Err(answer.json) }
    }

    fn hear(&mut self, text: &str) -> Result<(), String> {
        let end = self.bench.world.now() + ANSWER_WITHIN;
        while self.heard.is_empty() && self.bench.world.now() < end {
            self.run(LOOK_EVERY);
        }
        let frame = self.heard.pop_front().ok_or("heard nothing")?;
        let mut words = text.split_whitespace();
        let any = pattern_bytes(words.next().unwrap_or_default(), &frame).ok_or(format!("heard {frame}"))?;
        let Some((low, high)) = words.next().and_then(range) else { return Ok(()) };
        let value = signed(&any);
        if (low..=high).contains(&value) { Ok(()) } else { Err(format!("heard {value} in {frame}")) }
    }
}

fn first_word(text: &str) -> &str {
    text.split_whitespace().next().unwrap_or_default()
}

/// The bytes that stand where the pattern has `..`; `None` if the frame is another.
fn pattern_bytes(pattern: &str, frame: &Frame) -> Option<Vec<u8>> {
    let frame = frame.to_string();
    let agrees = pattern.len() == frame.len() && pattern.chars().zip(frame.chars()).all(|(p, f)| p == '.' || p == f);
    if !agrees {
        return None;
    }
    let data = pattern.find('#')? + 1;
    let any = (data..pattern.len()).step_by(2).filter(|at| pattern[*at..].starts_with(".."));
    any.map(|at| u8::from_str_radix(&frame[at..at + 2], 16).ok()).collect()
}

fn range(text: &str) -> Option<(i64, i64)> {
    let (low, high) = text.split_once("..")?;
    Some((low.parse().ok()?, high.parse().ok()?))
}

/// Little-endian, in as many bytes as there are.
fn signed(bytes: &[u8]) -> i64 {
    let negative = bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let fill = if negative { 0xFF } else { 0 };
    let mut wide = [fill; 8];
    wide.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    i64::from_le_bytes(wide)
}
