// Box2D v3 alone: discs that lie on a floor, or are thrown at it. Reads runs from standard input, writes their ends.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { packages, runs } = JSON.parse(readFileSync(0, "utf8"));
const { default: createBox2d } = await import(pathToFileURL(`${packages}/box2d3-wasm/build/dist/es/entry.mjs`));
const b2 = await createBox2d({ pthreadCount: 0 });

function shaped(friction, restitution, resists = 0) {
  const def = b2.b2DefaultShapeDef();
  [def.material.friction, def.material.restitution, def.material.rollingResistance] = [friction, restitution, resists];
  return def;
}

// One disc of a radius over the line y = 0; gravity leans where there is a slope.
function ended({ gravity, radius, height, velocity, spin, friction, restitution, resists, turns, steps, hertz }) {
  const worldDef = b2.b2DefaultWorldDef();
  worldDef.gravity.Set(...gravity);
  worldDef.enableSleep = false;
  worldDef.restitutionThreshold = 0;
  const world = b2.b2CreateWorld(worldDef);
  const floor = b2.b2CreateBody(world, b2.b2DefaultBodyDef());
  const centre = new b2.b2Vec2(0, -50);
  b2.b2CreatePolygonShape(floor, shaped(friction, restitution, resists), b2.b2MakeOffsetBox(500, 50, centre, b2.b2MakeRot(0)));
  const bodyDef = b2.b2DefaultBodyDef();
  bodyDef.type = b2.b2BodyType.b2_dynamicBody;
  bodyDef.position.Set(0, radius + height);
  bodyDef.linearVelocity.Set(...velocity);
  bodyDef.angularVelocity = spin;
  bodyDef.motionLocks.angularZ = !turns;
  const body = b2.b2CreateBody(world, bodyDef);
  const circle = new b2.b2Circle();
  circle.radius = radius;
  b2.b2CreateCircleShape(body, shaped(friction, restitution), circle);
  for (let step = 0; step < steps; step++) b2.b2World_Step(world, 1 / hertz, 4);
  const [v, place] = [b2.b2Body_GetLinearVelocity(body), b2.b2Body_GetPosition(body)];
  const end = [place.x, place.y, v.x, v.y, b2.b2Body_GetAngularVelocity(body)];
  b2.b2DestroyWorld(world);
  return end;
}

console.log(JSON.stringify(runs.map(ended)));
