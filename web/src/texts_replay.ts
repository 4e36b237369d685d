/** Texts of the replay of a session: English, German, Spanish, as in texts.ts. */

type Row = readonly [en: string, de: string, es: string];

export const replayTexts = {
  replay: ["Replay", "Wiedergeben", "Reproducir"],
  replayTitle: ["Replay of {session}", "Wiedergabe von {session}", "Reproducción de {session}"],
  replayHow: ["This is a recording. Nothing here acts on the session that runs, or on an arm.", "Das ist eine Aufzeichnung. Nichts hier wirkt auf die laufende Sitzung oder auf einen Arm.", "Es una grabación. Nada de aquí actúa sobre la sesión en curso ni sobre un brazo."],
  replayBack: ["To the session that runs", "Zur laufenden Sitzung", "A la sesión en curso"],
  replayReading: ["Reading the session …", "Die Sitzung wird gelesen …", "Leyendo la sesión …"],
  replayAhead: ["Touched again from the scan on, up to {time}: {share}", "Wird vom Scan an neu angetastet, bis {time}: {share}", "Se toca de nuevo desde el escaneo, hasta {time}: {share}"],
  replayDamaged: ["The recording is damaged and ends early: {reason}", "Die Aufzeichnung ist beschädigt und endet früher: {reason}", "La grabación está dañada y termina antes: {reason}"],
  replayFailed: ["The session cannot be replayed: {reason}", "Die Sitzung lässt sich nicht wiedergeben: {reason}", "La sesión no se puede reproducir: {reason}"],
  replayPlace: ["Place in the recording", "Stelle in der Aufzeichnung", "Punto de la grabación"],
  replaySpeed: ["Speed", "Geschwindigkeit", "Velocidad"],
  replayTimes: ["{speed} times", "{speed}-fach", "{speed} veces"],
  replayFromStart: ["From the start", "Von vorn", "Desde el principio"],
  replayRole: ["replay", "Wiedergabe", "reproducción"],
  whyReplay: ["A replay: nothing can be changed here.", "Eine Wiedergabe: Hier lässt sich nichts ändern.", "Es una reproducción: aquí no se puede cambiar nada."],
  lineEnded: ["not connected", "nicht verbunden", "sin conexión"],
} as const satisfies Record<string, Row>;
