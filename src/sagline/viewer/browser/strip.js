// Strip below a picture or a film (features/export.py): title, remark, colors of tensions, and the clock of a film.
(() => {
  const INK = "#1f2328", QUIET = "#57606a", LINE = "#d0d5db", BAD = "#b42323";
  const FONT = "system-ui, sans-serif";

  const write = (context, text, x, y, { size, weight = 400, color = INK, align = "left", room }) => {
    context.font = `${weight} ${size}px ${FONT}`;
    context.fillStyle = color;
    context.textAlign = align;
    context.fillText(text, x, y, room);
  };

  const drawLegend = (context, about, left, width, top) => {
    const { text: em, colors, ticks, legend } = about;
    write(context, legend, left, top + 1.15 * em, { size: 0.8 * em, room: width });
    const ramp = context.createLinearGradient(left, 0, left + width, 0);
    colors.forEach((color, i) => ramp.addColorStop(i / (colors.length - 1), color));
    context.fillStyle = ramp;
    context.fillRect(left, top + 1.45 * em, width, 0.6 * em);
    let taken = -Infinity;
    for (const [number, share] of ticks) {
      const at = left + share * width;
      context.fillStyle = INK;
      context.fillRect(at - 0.04 * em, top + 2.05 * em, 0.08 * em, 0.25 * em);
      const inside = measured(context, number, 0.8 * em); // numbers at the ends remain above the bar
      const middle = Math.min(Math.max(at, left + 0.5 * inside), left + width - 0.5 * inside);
      if (middle - 0.5 * inside < taken) continue; // no space for this number
      taken = middle + 0.5 * inside + 0.4 * em;
      write(context, number, middle, top + 3.15 * em, { size: 0.8 * em, align: "center" });
    }
  };
  const measured = (context, text, size) => {
    context.font = `400 ${size}px ${FONT}`;
    return context.measureText(text).width;
  };

  // Draw a picture with its strip onto a canvas of the requested size.
  window.sagline.compose = (context, about, picture, clock) => {
    const { width, height, strip, text: em, title, remark } = about;
    const room = height - strip, top = room;
    context.fillStyle = "#ffffff";
    context.fillRect(0, 0, width, height);
    context.drawImage(picture, Math.round(0.5 * (width - picture.width)), Math.round(0.5 * (room - picture.height)));
    if (!strip) return;
    context.fillStyle = "#ffffff"; // a larger picture would extend below
    context.fillRect(0, top, width, strip);
    context.fillStyle = LINE;
    context.fillRect(0, top, width, Math.max(1, Math.round(0.05 * em)));
    const beside = clock ? 9 * em : 0; // width beside the legend
    const bar = Math.min(0.42 * width, 24 * em);
    const left = clock ? 0.5 * (width - bar) : width - bar - em;
    const until = left - 2 * em;
    write(context, title, em, top + 1.75 * em, { size: 1.15 * em, weight: 600, room: until });
    write(context, remark, em, top + 3.15 * em, { size: 0.8 * em, color: QUIET, room: until });
    drawLegend(context, about, left, bar, top);
    if (!clock) return;
    const edge = width - em;
    write(context, clock.time, edge, top + 1.75 * em, { size: 1.3 * em, weight: 600, align: "right", room: beside });
    write(context, clock.text, edge, top + 3.15 * em, { size: 0.8 * em, color: BAD, align: "right", room: 2 * beside });
  };
})();
