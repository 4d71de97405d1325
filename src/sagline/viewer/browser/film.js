// Recording of a film (features/export.py): its progress, and a button to cancel it.
(() => {
  const { sagline } = window;
  let film; // the film that is being recorded
  let clock; // text of the clock in the next picture

  const panel = (about) => {
    const box = document.createElement("div");
    box.id = "sagline-film";
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", "Film");
    box.innerHTML = `<p role="status"></p><progress aria-label="Progress of the film"></progress><button>Cancel</button>`;
    const [words, bar, button] = box.children;
    bar.max = about.count;
    button.addEventListener("click", () => {
      sagline.send("film", "cancel");
      box.remove();
      drop();
    });
    document.body.append(box);
    return {
      say: (text) => {
        words.textContent = text;
      },
      at: (count) => {
        bar.value = count;
        bar.title = `${count} of ${about.count}`;
      },
      end: (text) => {
        words.textContent = text;
        bar.remove();
        button.textContent = "Close";
      },
      remove: () => box.remove(),
    };
  };

  const drop = (why) => {
    sagline.keep(undefined);
    if (why) film?.panel.end(why);
    else film?.panel.remove();
    film?.maker?.stop();
    film = undefined;
  };

  const begin = async (about) => {
    drop();
    const mine = { about, count: 0, panel: panel(about) };
    film = mine;
    mine.panel.say("Recording: keep this page visible. Other users do not see it.");
    const maker = sagline.filming(about);
    sagline.keep(async (blob) => {
      if (!clock) return; // a picture before the film
      try {
        mine.maker = await maker;
        await mine.maker.add({ blob, clock });
        mine.count += 1;
        mine.panel.at(mine.count);
        if (mine.count === about.count) finish(mine);
      } catch (error) {
        if (mine === film) fail(error);
      }
    });
  };

  const finish = async (mine) => {
    sagline.keep(undefined);
    mine.panel.say("Finishing the film.");
    try {
      const made = await mine.maker.finish(mine.panel.at);
      if (mine !== film) return; // cancelled
      sagline.save(made, `${mine.about.name}.${made.type.includes("mp4") ? "mp4" : "webm"}`);
      drop();
    } catch (error) {
      if (mine === film) fail(error);
    }
  };
  const fail = (error) => {
    sagline.send("film", "cancel");
    drop(`No film: ${error.message}.`);
  };

  sagline.on("film clock", (value) => {
    clock = value;
  });
  const waiting = () => film && film.count < film.about.count;
  sagline.on("film", (about) => {
    if (about) begin(about);
    else if (waiting()) drop();
  });
  sagline.on("connected", (stands) => {
    if (!stands && waiting()) drop("No film: the connection was lost.");
  });
})();
