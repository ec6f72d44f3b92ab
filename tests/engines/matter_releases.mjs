// node matter_releases.mjs FOLDER: the inertia of a disc over mass times radius squared in a release of matter.js, as made and after
// `Body.setMass`, as JSON.
import { createRequire } from "node:module";

const { Bodies, Body } = createRequire(`${process.argv[2]}/x.cjs`)("matter-js");
const body = Bodies.circle(0, 0, 10);
const made = body.inertia / body.mass / 100;
Body.setMass(body, 1);
process.stdout.write(JSON.stringify([made, body.inertia / body.mass / 100]) + "\n");
