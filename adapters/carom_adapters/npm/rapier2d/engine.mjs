// Rapier's plane build as WebAssembly, with 32-bit floats.
import RAPIER from "@dimforge/rapier2d-compat";
import { Clock, contactOf, isImmovable, serve, wallBody } from "../serve.mjs";

await RAPIER.init();
const { CoefficientCombineRule: Rule, ColliderDesc, RigidBodyDesc } = RAPIER;
const PARAMETERS = ["lengthUnit", "normalizedPredictionDistance", "numSolverIterations", "maxCcdSubsteps"];
const WRITE_ONLY = ["contact_natural_frequency"];
// Compiled in, in lengths a second: what is faster is slowed down to it.
const FASTEST = 400;

class RapierWorld {
  constructor(scene, settings) {
    this.asked = settings;
    this.clock = new Clock(settings.dt_s);
    const [x, y] = scene.gravity_m_s2;
    this.world = new RAPIER.World({ x, y });
    this.world.timestep = settings.dt_s;
    for (const name of [...PARAMETERS, ...WRITE_ONLY]) if (name in settings) this.world.integrationParameters[name] = settings[name];
    this.numbers = new Map(); // by the colliders' handles
    this.bodies = scene.discs.map((disc, i) => this.addDisc(scene, disc, i));
    scene.walls.forEach((wall, k) => this.addWall(scene, wall, k));
  }

  addDisc(scene, disc, i) {
    const { canSleep, ccdEnabled, softCcdPrediction } = this.asked;
    const desc = isImmovable(disc) ? RigidBodyDesc.fixed() : RigidBodyDesc.dynamic().setAdditionalMass(disc.mass_kg);
    desc.setTranslation(...disc.position_m).setLinvel(...disc.velocity_m_s).lockRotations();
    desc.setCanSleep(canSleep).setCcdEnabled(ccdEnabled).setSoftCcdPrediction(softCcdPrediction);
    const body = this.world.createRigidBody(desc);
    const ball = ColliderDesc.ball(disc.radius_m).setDensity(0).setFriction(0).setRestitution(scene.restitution);
    this.numbers.set(this.world.createCollider(ball, body).handle, i);
    return body;
  }

  // Two coefficients are combined by the rule that stands later in Rapier's list: a wall's is to be the pair's.
  addWall(scene, { point_m: [px, py], normal: [x, y] }, k) {
    const body = this.world.createRigidBody(RigidBodyDesc.fixed().setTranslation(px, py));
    const rule = scene.wall_restitution < scene.restitution ? Rule.Min : Rule.Max;
    const wall = ColliderDesc.halfspace({ x, y }).setFriction(0).setRestitution(scene.wall_restitution);
    this.numbers.set(this.world.createCollider(wall.setRestitutionCombineRule(rule), body).handle, wallBody(k));
  }

  get settings() {
    const read = PARAMETERS.map((name) => [name, this.world.integrationParameters[name]]);
    return { ...this.asked, ...Object.fromEntries(read), dt_s: this.clock.dt };
  }

  step() {
    this.world.step();
    this.clock.steps++;
  }

  observe() {
    const velocity_m_s = this.bodies.map((body) => [body.linvel().x, body.linvel().y]);
    const most = FASTEST * this.world.lengthUnit;
    const fastest = Math.max(...velocity_m_s.map((v) => Math.hypot(...v)));
    return {
      position_m: this.bodies.map((body) => [body.translation().x, body.translation().y]),
      velocity_m_s,
      contacts: this.contacts(),
      warning: fastest > most * (1 - 1e-6) ? `a disc was slowed down to ${most} m/s` : "",
    };
  }

  contacts() {
    const found = [];
    for (const body of this.bodies) {
      const own = body.collider(0);
      const a = this.numbers.get(own.handle);
      this.world.contactPairsWith(own, (other) => {
        const b = this.numbers.get(other.handle);
        if (b >= 0 && b < a) return; // was told by the other
        this.world.contactPair(own, other, (manifold, flipped) => {
          let impulse = 0;
          for (let k = 0; k < manifold.numContacts(); k++) impulse += manifold.contactImpulse(k);
          if (!(impulse > 0)) return;
          const { x, y } = manifold.normal();
          const sign = flipped ? -1 : 1;
          found.push(contactOf(a, b, this.clock.stepBegan, sign * x, sign * y, impulse));
        });
      });
    }
    return found;
  }

  free() {
    this.world.free();
  }
}

await serve(RapierWorld);
