// An engine behind Carom's protocol: a toy in World, the protocol below it. Put your engine in place of World.
#include <charconv>
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

struct Json {  // as much of JSON as the protocol needs; take a library where you have one
  std::string raw;  // the value as it was written
  std::vector<Json> items;
  std::map<std::string, Json> fields;
  const Json& operator[](const std::string& name) const { return fields.count(name) ? fields.at(name) : throw std::runtime_error("there is no " + name); }
  double number() const { return raw == "\"inf\"" ? INFINITY : std::stod(raw); }  // JSON has no infinity
  bool is(const char* text) const { return raw == '"' + std::string(text) + '"'; }
};

Json parse(const std::string& text, size_t& at, int depth = 0) {
  if (depth > 64) throw std::runtime_error("nested too deep");
  auto blank = [&] { while (std::isspace(static_cast<unsigned char>(text.at(at)))) ++at; };
  auto quoted = [&] {
    size_t begin = at++;
    for (; text.at(at) != '"'; ++at) if (text[at] == '\\') ++at;
    return text.substr(begin, ++at - begin);
  };
  blank();
  Json found;
  const size_t begin = at;
  if (text.at(at) == '{' || text[at] == '[') {
    const char close = text[at++] == '{' ? '}' : ']';
    for (blank(); text.at(at) != close; blank()) {
      if (text[at] == ',') { ++at; blank(); }
      std::string name;
      if (close == '}') { name = quoted(); blank(); ++at; }  // and the colon
      Json value = parse(text, at, depth + 1);
      if (close == ']') found.items.push_back(value);
      else found.fields[name.substr(1, name.size() - 2)] = value;
    }
    ++at;
  } else if (text[at] == '"') quoted();
  else if ((at = std::min(text.find_first_of(",]} \t\r\n", at), text.size())) == begin) throw std::runtime_error("no value");
  found.raw = text.substr(begin, at - begin);
  return found;
}

std::string written(double value) {  // the shortest text that reads back as the same double
  if (!std::isfinite(value)) return "null";
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}
std::string written(double x, double y) { return '[' + written(x) + ',' + written(y) + ']'; }
struct Wall { double x, y, nx, ny; };
struct Disc { double x, y, vx, vy, radius, inverse_mass; };
struct Overlap { int first, second; double nx, ny; };  // unit normal from first to second; wall k is body -1 - k

struct World {
  std::vector<Disc> discs;
  std::vector<Wall> walls;
  double dt, restitution, wall_restitution, gx, gy, time = 0;
  std::string contacts;
  World(const Json& scene, const Json& settings) : dt(settings["dt_s"].number()) {
    restitution = scene["restitution"].number(), wall_restitution = scene["wall_restitution"].number();
    gx = scene["gravity_m_s2"].items.at(0).number(), gy = scene["gravity_m_s2"].items.at(1).number();
    for (const Json& disc : scene["discs"].items) {
      const auto &x = disc["position_m"].items, &v = disc["velocity_m_s"].items;
      discs.push_back({x.at(0).number(), x.at(1).number(), v.at(0).number(), v.at(1).number(),
                       disc["radius_m"].number(), 1 / disc["mass_kg"].number()});
    }
    for (const Json& wall : scene["walls"].items) {
      const auto &p = wall["point_m"].items, &n = wall["normal"].items;
      walls.push_back({p.at(0).number(), p.at(1).number(), n.at(0).number(), n.at(1).number()});
    }
  }

  std::vector<Overlap> overlapping() const {
    std::vector<Overlap> found;
    for (int i = 0; i < int(discs.size()); ++i) {
      const Disc& a = discs[i];
      for (int k = 0; k < int(walls.size()); ++k)
        if (const Wall& w = walls[k]; (a.x - w.x) * w.nx + (a.y - w.y) * w.ny < a.radius) found.push_back({i, -1 - k, -w.nx, -w.ny});
      for (int j = i + 1; j < int(discs.size()); ++j) {
        const double dx = discs[j].x - a.x, dy = discs[j].y - a.y, distance = std::hypot(dx, dy);
        if (distance < a.radius + discs[j].radius) found.push_back({i, j, dx / distance, dy / distance});
      }
    }
    return found;
  }
  void step() {
    contacts.clear();
    for (const Overlap& o : overlapping()) {
      Disc wall{0, 0, 0, 0, 0, 0}, &a = discs[o.first], &b = o.second < 0 ? wall : discs[o.second];
      const double closing = (a.vx - b.vx) * o.nx + (a.vy - b.vy) * o.ny, inverse = a.inverse_mass + b.inverse_mass;
      if (closing <= 0 || inverse == 0) continue;
      const double impulse = (1 + (o.second < 0 ? wall_restitution : restitution)) * closing / inverse;
      a.vx -= impulse * a.inverse_mass * o.nx, a.vy -= impulse * a.inverse_mass * o.ny;
      b.vx += impulse * b.inverse_mass * o.nx, b.vy += impulse * b.inverse_mass * o.ny;
      contacts += std::string(contacts.empty() ? "" : ",") + "{\"first\":" + std::to_string(o.first) + ",\"second\":" +
                  std::to_string(o.second) + ",\"time_s\":" + written(time) + ",\"normal\":" + written(o.nx, o.ny) +
                  ",\"impulse_n_s\":" + written(impulse) + '}';
    }
    for (Disc& disc : discs) {
      if (disc.inverse_mass == 0) continue;
      disc.x += (disc.vx + gx * dt / 2) * dt, disc.y += (disc.vy + gy * dt / 2) * dt;
      disc.vx += gx * dt, disc.vy += gy * dt;
    }
    time += dt;
  }
};

std::map<int, World> worlds;
std::string answer(const Json& request) {
  const Json& what = request["do"];
  if (what.is("hello")) return R"({"protocol":1,"version":"1.0"})";
  if (what.is("prepare")) {
    const int number = worlds.empty() ? 1 : worlds.rbegin()->first + 1;
    worlds.emplace(number, World(request["scene"], request["settings"]));
    return "{\"world\":" + std::to_string(number) + ",\"settings\":{\"dt_s\":" + written(worlds.at(number).dt) + "}}";
  }
  World& world = worlds.at(int(request["world"].number()));
  if (what.is("step")) {
    const auto began = std::chrono::steady_clock::now();  // the program's own clock: pipes are no part of it
    for (int left = int(request["steps"].number()); left > 0; --left) world.step();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    return "{\"seconds\":" + written(took.count()) + '}';
  }
  if (what.is("observe")) {
    std::string positions, velocities;
    for (const Disc& disc : world.discs) {
      const char* comma = positions.empty() ? "" : ",";
      positions += comma + written(disc.x, disc.y), velocities += comma + written(disc.vx, disc.vy);
    }
    return "{\"position_m\":[" + positions + "],\"velocity_m_s\":[" + velocities + "],\"contacts\":[" + world.contacts + "]}";
  }
  if (what.is("close")) return worlds.erase(int(request["world"].number())), "{}";
  throw std::runtime_error("there is no such request");
}

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    size_t at = 0;
    try {
      std::cout << answer(parse(line, at)) << std::endl;
    } catch (const std::exception& error) {  // "refused", where it is what was asked for
      std::cout << R"({"error":{"kind":"failed","message":")" << error.what() << "\"}}" << std::endl;
    }
  }
}
