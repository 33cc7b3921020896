// An adapter in Rust: one file, no dependencies: copy it, and put your own functions into the table in `value`.
//
//     rustc -O adapter.rs
//     vslam-ref verify --program ./adapter --topic so3 --topic se3
//
// One request a line in, one reply a line out; nothing else may go to standard output (println! writes there,
// eprintln! does not).
//
//   1 your functions   2 the table   3 between the two   4 JSON.  Yours are 1 and 2; keep the rest.

use std::io::{BufRead, Write};

// ------------------------------------------------------------------ 1 your functions

type Mat = Vec<Vec<f64>>; // a list of rows

fn norm(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Rotation matrix of a rotation vector: I + a hat(phi) + b hat(phi)^2.
fn so3_exp(phi: &[f64]) -> Mat {
    let (x, y, z, angle) = (phi[0], phi[1], phi[2], norm(phi));
    let tiny = angle < 1e-8;
    let a = if tiny { 1.0 } else { angle.sin() / angle };
    let b = if tiny { 0.5 } else { 2.0 * ((angle / 2.0).sin() / angle).powi(2) };
    vec![
        vec![1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
        vec![b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x],
        vec![b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)],
    ]
}

/// The point T x.
fn se3_act(t: &Mat, x: &[f64]) -> Vec<f64> {
    t[..3].iter().map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3]).collect()
}

// ------------------------------------------------------------------ 2 the table

enum Answer {
    Value(Json),
    Unsupported,
    Refused(String),
}

/// The function's name and its inputs -> a value; 'vslam-ref vectors list' names all.
fn value(function: &str, i: &Json) -> Result<Answer, String> {
    Ok(Answer::Value(match function {
        "so3.exp" => matrix(&so3_exp(&i.vec("phi")?)),
        "se3.act" => vector(&se3_act(&i.mat("T")?, &i.vec("x")?)),
        "camera.project" => {
            let (p, point) = (i.vec("params")?, i.vec("X_cam")?);
            if i.text("model")? != "pinhole" {
                return Ok(Answer::Unsupported); // a camera that this program does not have
            }
            if !(point[2] > 0.0) {
                return Ok(Answer::Refused("the point is not in front of the camera".into()));
            }
            let uv = [p[0] * point[0] / point[2] + p[2], p[1] * point[1] / point[2] + p[3]];
            object(vec![("uv", vector(&uv)), ("valid", Json::Bool(true))])
        }
        _ => return Ok(Answer::Unsupported),
    }))
}

// ------------------------------------------------------------------ 3 between the two

impl Json {
    fn get(&self, name: &str) -> Result<&Json, String> {
        match self {
            Json::Object(fields) => fields.iter().find(|(key, _)| key == name).map(|(_, v)| v),
            _ => None,
        }
        .ok_or(format!("no field {name}"))
    }
    #[allow(dead_code)]
    fn number(&self, name: &str) -> Result<f64, String> {
        self.get(name)?.f64()
    }
    fn text(&self, name: &str) -> Result<&str, String> {
        match self.get(name)? {
            Json::Text(text) => Ok(text),
            _ => Err(format!("{name} is no text")),
        }
    }
    fn vec(&self, name: &str) -> Result<Vec<f64>, String> {
        self.get(name)?.list()?.iter().map(Json::f64).collect()
    }
    fn mat(&self, name: &str) -> Result<Mat, String> {
        self.get(name)?.list()?.iter().map(|row| row.list()?.iter().map(Json::f64).collect()).collect()
    }
    fn list(&self) -> Result<&Vec<Json>, String> {
        match self {
            Json::List(items) => Ok(items),
            _ => Err("no list".into()),
        }
    }
    fn f64(&self) -> Result<f64, String> {
        match self {
            Json::Number(x) => Ok(*x),
            Json::Bool(x) => Ok(f64::from(u8::from(*x))),
            Json::Text(word) => match word.as_str() {
                "nan" => Ok(f64::NAN),
                "inf" => Ok(f64::INFINITY),
                "-inf" => Ok(f64::NEG_INFINITY),
                _ => Err(format!("{word} is no number")),
            },
            _ => Err("no number".into()),
        }
    }
}

fn vector(x: &[f64]) -> Json {
    Json::List(x.iter().map(|v| Json::Number(*v)).collect())
}
fn matrix(x: &Mat) -> Json {
    Json::List(x.iter().map(|row| vector(row)).collect())
}
fn object(fields: Vec<(&str, Json)>) -> Json {
    Json::Object(fields.into_iter().map(|(key, v)| (key.to_string(), v)).collect())
}

/// One reply; whatever a function does, also a panic, becomes one.
fn reply(line: &str) -> Json {
    let request = match parse(line) {
        Ok(request) => request,
        Err(why) => return object(vec![("id", Json::Null), ("error", Json::Text(why))]),
    };
    let id = request.get("id").cloned().unwrap_or(Json::Null);
    let called = std::panic::catch_unwind(|| value(request.text("function")?, request.get("inputs")?));
    let answer = match called {
        Ok(Ok(answer)) => answer,
        Ok(Err(why)) => Answer::Refused(why),
        Err(_) => Answer::Refused("panic".into()),
    };
    let said = match answer {
        Answer::Value(found) => ("value", found),
        Answer::Unsupported => ("unsupported", Json::Bool(true)),
        Answer::Refused(why) => ("error", Json::Text(why)),
    };
    object(vec![("id", id), said])
}

fn main() {
    for line in std::io::stdin().lock().lines() {
        let Ok(line) = line else { break };
        if line.trim().is_empty() {
            continue;
        }
        let mut out = String::new();
        write(&mut out, &reply(&line));
        println!("{out}");
        std::io::stdout().flush().unwrap(); // the other side waits for it
    }
}

// ------------------------------------------------------------------ 4 JSON

#[derive(Clone)]
enum Json {
    Null,
    Bool(bool),
    Number(f64),
    Text(String),
    List(Vec<Json>),
    Object(Vec<(String, Json)>),
}

fn write(out: &mut String, json: &Json) {
    match json {
        Json::Null => out.push_str("null"),
        Json::Bool(x) => out.push_str(if *x { "true" } else { "false" }),
        Json::Number(x) if x.is_finite() => out.push_str(&format!("{x:e}")), // reads back to the same bits
        Json::Number(x) => out.push_str(if x.is_nan() { "\"nan\"" } else if *x > 0.0 { "\"inf\"" } else { "\"-inf\"" }),
        Json::Text(text) => write_text(out, text),
        Json::List(items) => {
            out.push('[');
            for (k, item) in items.iter().enumerate() {
                out.push_str(if k > 0 { ", " } else { "" });
                write(out, item);
            }
            out.push(']');
        }
        Json::Object(fields) => {
            out.push('{');
            for (k, (name, item)) in fields.iter().enumerate() {
                out.push_str(if k > 0 { ", " } else { "" });
                write_text(out, name);
                out.push_str(": ");
                write(out, item);
            }
            out.push('}');
        }
    }
}

fn write_text(out: &mut String, text: &str) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if (c as u32) < 0x20 => out.push_str(&format!("\\u{:04x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
}

fn parse(text: &str) -> Result<Json, String> {
    let mut reader = Reader { s: text.as_bytes(), at: 0 };
    let json = reader.value()?;
    reader.space();
    if reader.at < reader.s.len() {
        return reader.fail("text after the end");
    }
    Ok(json)
}

struct Reader<'a> {
    s: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn fail<T>(&self, why: &str) -> Result<T, String> {
        Err(format!("JSON, byte {}: {why}", self.at + 1))
    }
    fn space(&mut self) {
        while self.at < self.s.len() && self.s[self.at].is_ascii_whitespace() {
            self.at += 1;
        }
    }
    fn eat(&mut self, c: u8) -> bool {
        self.space();
        let there = self.s.get(self.at) == Some(&c);
        self.at += usize::from(there);
        there
    }
    fn word(&mut self, word: &str, json: Json) -> Result<Json, String> {
        if !self.s[self.at..].starts_with(word.as_bytes()) {
            return self.fail("expected a value");
        }
        self.at += word.len();
        Ok(json)
    }
    fn value(&mut self) -> Result<Json, String> {
        self.space();
        match self.s.get(self.at) {
            None => self.fail("it ends too early"),
            Some(b'{') => self.object(),
            Some(b'[') => self.items(),
            Some(b'"') => Ok(Json::Text(self.string()?)),
            Some(b't') => self.word("true", Json::Bool(true)),
            Some(b'f') => self.word("false", Json::Bool(false)),
            Some(b'n') => self.word("null", Json::Null),
            _ => self.digits(),
        }
    }
    fn digits(&mut self) -> Result<Json, String> {
        let start = self.at;
        while self.at < self.s.len() && b"+-.0123456789eE".contains(&self.s[self.at]) {
            self.at += 1;
        }
        match std::str::from_utf8(&self.s[start..self.at]).unwrap_or("").parse() {
            Ok(x) => Ok(Json::Number(x)),
            Err(_) => self.fail("expected a value"),
        }
    }
    fn items(&mut self) -> Result<Json, String> {
        self.at += 1;
        let mut items = vec![];
        if self.eat(b']') {
            return Ok(Json::List(items));
        }
        loop {
            items.push(self.value()?);
            if self.eat(b']') {
                return Ok(Json::List(items));
            }
            if !self.eat(b',') {
                return self.fail("expected , or ]");
            }
        }
    }
    fn object(&mut self) -> Result<Json, String> {
        self.at += 1;
        let mut fields = vec![];
        if self.eat(b'}') {
            return Ok(Json::Object(fields));
        }
        loop {
            self.space();
            let name = self.string()?;
            if !self.eat(b':') {
                return self.fail("expected a colon");
            }
            fields.push((name, self.value()?));
            if self.eat(b'}') {
                return Ok(Json::Object(fields));
            }
            if !self.eat(b',') {
                return self.fail("expected , or }");
            }
        }
    }
    fn string(&mut self) -> Result<String, String> {
        if !self.eat(b'"') {
            return self.fail("expected a text");
        }
        let mut out: Vec<u8> = vec![];
        loop {
            let Some(&c) = self.s.get(self.at) else { return self.fail("a text without end") };
            self.at += 1;
            match c {
                b'"' => return String::from_utf8(out).map_err(|_| "no UTF-8".into()),
                b'\\' => self.escape(&mut out)?,
                _ => out.push(c),
            }
        }
    }
    fn escape(&mut self, out: &mut Vec<u8>) -> Result<(), String> {
        let Some(&c) = self.s.get(self.at) else { return self.fail("a text without end") };
        self.at += 1;
        match c {
            b'n' => out.push(b'\n'),
            b't' => out.push(b'\t'),
            b'r' => out.push(b'\r'),
            b'b' => out.push(8),
            b'f' => out.push(12),
            b'u' => {
                let mut code = self.hex()?;
                if (0xd800..0xdc00).contains(&code) && self.s[self.at..].starts_with(b"\\u") {
                    self.at += 2; // the second half of a pair
                    code = 0x10000 + ((code - 0xd800) << 10) + (self.hex()?.wrapping_sub(0xdc00) & 0x3ff);
                }
                let letter = char::from_u32(code).unwrap_or('\u{fffd}');
                out.extend_from_slice(letter.encode_utf8(&mut [0; 4]).as_bytes());
            }
            c => out.push(c),
        }
        Ok(())
    }
    fn hex(&mut self) -> Result<u32, String> {
        let digits = self.s.get(self.at..self.at + 4).and_then(|b| std::str::from_utf8(b).ok());
        match digits.and_then(|d| u32::from_str_radix(d, 16).ok()) {
            Some(code) => {
                self.at += 4;
                Ok(code)
            }
            None => self.fail("expected four hexadecimal digits"),
        }
    }
}
