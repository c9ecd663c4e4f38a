// What each world looks like: its colour of view.css, and how it is painted over the dial, whose angles count from the vertical, or the rail.
// `line(place, from, to, width, stroke)` stands on a place, `sector(from, to, fill)` fills between two, `at(place, r)` is a point; `low` to `high`
// is what is seen, and `unit` the place that stands for a radian.

const TURN_RAD = 0.8, FACE_RAD = 0.5;

export const DRAWINGS = {
  wall: {
    colour: "obstacle",
    paint({ world, centre, length, line, sector, colour, unit }) {
      sector(centre, centre + (world.side < 0 ? -FACE_RAD : FACE_RAD) * unit, "obstacle");
      line(centre, length * 0.15, length * 1.02, 4, colour("obstacle"));
    },
  },
  spring: {
    colour: "object",
    paint({ draw, centre, handle, length, at, line, colour }) {
      const waves = 24, r = length * 0.6;
      draw.beginPath(); draw.strokeStyle = colour("object"); draw.lineWidth = 2;
      for (let k = 0; k <= waves; k++) {
        const angle = centre + (handle - centre) * k / waves, wave = [0, 1, 0, -1][k % 4] * length * 0.03;
        draw.lineTo(...at(angle, r + wave));
      }
      draw.stroke();
      line(centre, length * 0.5, length * 0.7, 3, colour("object"));
    },
  },
  detents: {
    colour: "object",
    paint({ world, centre, length, line, colour, low, high }) {
      if (!(world.pitch_rad > 0)) return;
      for (let k = Math.ceil((low - centre) / world.pitch_rad); centre + k * world.pitch_rad <= high; k++) line(centre + k * world.pitch_rad, length * 0.86, length, 5, colour("object"));
    },
  },
  damper: { colour: "object", paint({ sector, low, high }) { sector(Math.max(low, -TURN_RAD), Math.min(high, TURN_RAD), "object"); } },
  ball: { colour: "ball" },  // scene.js paints it where it rolls
};
