// An engine behind Carom's protocol: a toy in World, the protocol below it. Put your engine in place of World.
use std::{collections::HashMap, io::{self, BufRead, Write}, time::Instant};

/// As much of JSON as the protocol needs, without a crate; take serde_json where you have it.
enum Json { Plain(String), List(Vec<Json>), Table(HashMap<String, Json>) }

impl Json {
    fn field(&self, name: &str) -> Result<&Json, String> {
        match self { Json::Table(fields) => fields.get(name), _ => None }.ok_or(format!("there is no {name}"))
    }
    fn list(&self) -> &[Json] { if let Json::List(items) = self { items } else { &[] } }
    fn text(&self) -> &str { if let Json::Plain(text) = self { text } else { "" } }
    fn number(&self) -> Result<f64, String> { // "inf" is a word that Rust reads, too: JSON has no infinity
        self.text().parse().map_err(|_| format!("{} is no number", self.text()))
    }
    fn pair(&self, name: &str) -> Result<[f64; 2], String> {
        match self.field(name)?.list() { [x, y] => Ok([x.number()?, y.number()?]), _ => Err(format!("{name} is no pair")) }
    }
}

fn parse(text: &[u8], at: &mut usize, depth: u32) -> Result<Json, String> {
    if depth > 64 { return Err("nested too deep".into()) }
    let next = |at: &mut usize| { while matches!(text.get(*at), Some(b' ' | b'\t')) { *at += 1 } text.get(*at).copied() };
    let quoted = |at: &mut usize| {
        let begin = *at + 1;
        *at = begin;
        while text.get(*at).is_some_and(|c| *c != b'"') { *at += if text[*at] == b'\\' { 2 } else { 1 } }
        *at += 1;
        String::from_utf8_lossy(text.get(begin..*at - 1).unwrap_or(b"")).into_owned()
    };
    match next(at).ok_or("the line ends too soon")? {
        b'"' => Ok(Json::Plain(quoted(at))),
        open @ (b'{' | b'[') => {
            let (mut items, mut fields) = (Vec::new(), HashMap::new());
            *at += 1;
            while !matches!(next(at).ok_or("the line ends too soon")?, b'}' | b']') {
                if text[*at] == b',' { *at += 1; next(at); }
                if open == b'[' { items.push(parse(text, at, depth + 1)?); continue; }
                let name = quoted(at);
                next(at);
                *at += 1; // the colon
                fields.insert(name, parse(text, at, depth + 1)?);
            }
            *at += 1;
            Ok(if open == b'[' { Json::List(items) } else { Json::Table(fields) })
        }
        _ => {
            let begin = *at;
            while text.get(*at).is_some_and(|c| !b",]} ".contains(c)) { *at += 1 }
            Ok(Json::Plain(String::from_utf8_lossy(&text[begin..*at]).into_owned()))
        }
    }
}

struct Disc { x: [f64; 2], v: [f64; 2], radius: f64, inverse_mass: f64 }
struct World { discs: Vec<Disc>, walls: Vec<[[f64; 2]; 2]>, restitution: [f64; 2], gravity: [f64; 2], dt: f64, time: f64, contacts: Vec<String> }

impl World {
    fn new(scene: &Json, settings: &Json) -> Result<World, String> {
        let disc = |d: &Json| Ok(Disc {
            x: d.pair("position_m")?, v: d.pair("velocity_m_s")?,
            radius: d.field("radius_m")?.number()?, inverse_mass: 1.0 / d.field("mass_kg")?.number()?,
        });
        Ok(World {
            discs: scene.field("discs")?.list().iter().map(disc).collect::<Result<_, String>>()?,
            walls: scene.field("walls")?.list().iter().map(|w| Ok([w.pair("point_m")?, w.pair("normal")?])).collect::<Result<_, String>>()?,
            restitution: [scene.field("restitution")?.number()?, scene.field("wall_restitution")?.number()?],
            gravity: scene.pair("gravity_m_s2")?, dt: settings.field("dt_s")?.number()?, time: 0.0, contacts: Vec::new(),
        })
    }
    /// Every pair of bodies that overlap, with the unit normal from first to second; wall k is body -1 - k.
    fn overlapping(&self) -> Vec<(usize, i64, [f64; 2])> {
        let mut found = Vec::new();
        for (i, a) in self.discs.iter().enumerate() {
            for (k, [p, n]) in self.walls.iter().enumerate() {
                if (a.x[0] - p[0]) * n[0] + (a.x[1] - p[1]) * n[1] < a.radius { found.push((i, -1 - k as i64, [-n[0], -n[1]])) }
            }
            for (j, b) in self.discs.iter().enumerate().skip(i + 1) {
                let (dx, dy) = (b.x[0] - a.x[0], b.x[1] - a.x[1]);
                let distance = dx.hypot(dy);
                if distance < a.radius + b.radius { found.push((i, j as i64, [dx / distance, dy / distance])) }
            }
        }
        found
    }
    fn step(&mut self) {
        self.contacts.clear();
        for (i, other, [nx, ny]) in self.overlapping() {
            let wall = Disc { x: [0.0; 2], v: [0.0; 2], radius: 0.0, inverse_mass: 0.0 };
            let (a, b) = (&self.discs[i], if other < 0 { &wall } else { &self.discs[other as usize] });
            let closing = (a.v[0] - b.v[0]) * nx + (a.v[1] - b.v[1]) * ny;
            let inverse = a.inverse_mass + b.inverse_mass;
            if closing <= 0.0 || inverse == 0.0 { continue }
            let impulse = (1.0 + self.restitution[usize::from(other < 0)]) * closing / inverse;
            for (body, push) in [(i as i64, -impulse), (other, impulse)] {
                if body < 0 { continue }
                let disc = &mut self.discs[body as usize];
                for (v, n) in disc.v.iter_mut().zip([nx, ny]) { *v += push * disc.inverse_mass * n }
            }
            self.contacts.push(format!(r#"{{"first":{i},"second":{other},"time_s":{:?},"normal":[{nx:?},{ny:?}],"impulse_n_s":{impulse:?}}}"#, self.time));
        }
        for disc in self.discs.iter_mut().filter(|disc| disc.inverse_mass > 0.0) {
            for axis in 0..2 {
                disc.x[axis] += (disc.v[axis] + self.gravity[axis] * self.dt / 2.0) * self.dt;
                disc.v[axis] += self.gravity[axis] * self.dt;
            }
        }
        self.time += self.dt;
    }
}

fn answer(request: &Json, worlds: &mut Vec<Option<World>>) -> Result<String, String> {
    let what = request.field("do")?.text();
    if what == "hello" { return Ok(r#"{"protocol":1,"version":"1.0"}"#.into()) }
    if what == "prepare" {
        let world = World::new(request.field("scene")?, request.field("settings")?)?;
        let told = format!(r#"{{"world":{},"settings":{{"dt_s":{:?}}}}}"#, worlds.len(), world.dt);
        worlds.push(Some(world));
        return Ok(told);
    }
    let place = worlds.get_mut(request.field("world")?.number()? as usize).ok_or("there is no such world")?;
    if what == "close" { *place = None; return Ok("{}".into()) }
    let world = place.as_mut().ok_or("that world is closed")?;
    match what {
        "step" => {
            let began = Instant::now(); // the program's own clock: pipes are no part of it
            for _ in 0..request.field("steps")?.number()? as u64 { world.step() }
            Ok(format!(r#"{{"seconds":{:?}}}"#, began.elapsed().as_secs_f64()))
        }
        "observe" => {
            let positions: Vec<_> = world.discs.iter().map(|disc| disc.x).collect();
            let velocities: Vec<_> = world.discs.iter().map(|disc| disc.v).collect();
            Ok(format!(r#"{{"position_m":{positions:?},"velocity_m_s":{velocities:?},"contacts":[{}]}}"#, world.contacts.join(",")))
        }
        _ => Err(format!("there is no request {what}")), // answered as "refused" where it is what was asked for
    }
}

fn main() {
    let mut worlds = Vec::new();
    for line in io::stdin().lock().split(b'\n').map_while(Result::ok) {
        let told = parse(&line, &mut 0, 0).and_then(|request| answer(&request, &mut worlds));
        let told = told.map(|told| told.replace("-inf", "null").replace("inf", "null").replace("NaN", "null")); // JSON has none
        let plain = |why: String| why.replace(|c: char| matches!(c, '"' | '\\') || !matches!(c, ' '..='~'), "?");
        let told = told.unwrap_or_else(|why| format!(r#"{{"error":{{"kind":"failed","message":"{}"}}}}"#, plain(why)));
        println!("{told}");
        io::stdout().flush().expect("the harness reads");
    }
}
