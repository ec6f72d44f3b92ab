// A paddle that is put from place to place at -1 m/s, without a velocity, in engines' own calls, which a disc of 2 m/s meets at
// sixteen starts: for test_what_is_driven.py, which runs this where the engines are. Argument: package; output: how it leaves.
const [name] = process.argv.slice(-1);
const [STEPS, DT, V, START] = [60, 0.01, 2, -1];
const ENGINES = {
  async planck() {
    const { World, Vec2, Circle, Edge } = await import("planck");
    return (k) => {
      const world = new World({ gravity: new Vec2(0, 0) });
      const material = { restitution: 1, friction: 0 };
      const held = world.createBody({ type: "kinematic" });
      held.createFixture({ shape: new Edge(new Vec2(0, -1), new Vec2(0, 1)), ...material });
      const of = { type: "dynamic", position: new Vec2(START - (0.03 * k) / 16, 0), linearVelocity: new Vec2(V, 0) };
      const disc = world.createBody({ ...of, fixedRotation: true, allowSleep: false });
      disc.createFixture({ shape: new Circle(0.25), density: 1, ...material });
      for (let step = 0; step < STEPS; step++) {
        held.setPosition(new Vec2(-DT * step, 0));
        world.step(DT);
      }
      return disc.getLinearVelocity().x;
    };
  },
  async "@dimforge/rapier2d-compat"() {
    const { default: R } = await import("@dimforge/rapier2d-compat");
    await R.init();
    return (k) => {
      const world = new R.World({ x: 0, y: 0 });
      world.timestep = DT;
      const add = (shape, body) => world.createCollider(shape.setFriction(0).setRestitution(1), body);
      const held = world.createRigidBody(R.RigidBodyDesc.kinematicVelocityBased());
      add(R.ColliderDesc.segment({ x: 0, y: -1 }, { x: 0, y: 1 }), held);
      const of = R.RigidBodyDesc.dynamic().setTranslation(START - (0.03 * k) / 16, 0).setLinvel(V, 0);
      const disc = world.createRigidBody(of.lockRotations().setCanSleep(false));
      add(R.ColliderDesc.ball(0.25), disc);
      for (let step = 0; step < STEPS; step++) {
        held.setTranslation({ x: -DT * step, y: 0 }, true);
        world.step();
      }
      return disc.linvel().x;
    };
  },
  async "box2d3-wasm"() {
    const b2 = await (await import("box2d3-wasm")).default({ pthreadCount: 0 });
    return (k) => {
      const worldDef = b2.b2DefaultWorldDef();
      worldDef.gravity.Set(0, 0);
      const world = b2.b2CreateWorld(worldDef);
      const add = (type, x, speed) => {
        const def = b2.b2DefaultBodyDef();
        def.type = type;
        def.position.Set(x, 0);
        def.linearVelocity.Set(speed, 0);
        def.motionLocks.angularZ = true;
        def.enableSleep = false;
        return b2.b2CreateBody(world, def);
      };
      const shape = () => {
        const def = b2.b2DefaultShapeDef();
        [def.material.friction, def.material.restitution] = [0, 1];
        return def;
      };
      const held = add(b2.b2BodyType.b2_kinematicBody, 0, 0);
      const segment = new b2.b2Segment();
      segment.point1.Set(0, -1);
      segment.point2.Set(0, 1);
      b2.b2CreateSegmentShape(held, shape(), segment);
      const disc = add(b2.b2BodyType.b2_dynamicBody, START - (0.03 * k) / 16, V);
      const circle = new b2.b2Circle();
      circle.radius = 0.25;
      b2.b2CreateCircleShape(disc, shape(), circle);
      const turn = b2.b2MakeRot(0);
      for (let step = 0; step < STEPS; step++) {
        b2.b2Body_SetTransform(held, new b2.b2Vec2(-DT * step, 0), turn);
        b2.b2World_Step(world, DT, 4);
      }
      return b2.b2Body_GetLinearVelocity(disc).x;
    };
  },
};
const put = await ENGINES[name]();
process.stdout.write(JSON.stringify(Array.from({ length: 16 }, (_, k) => put(k))), () => process.exit(0));
