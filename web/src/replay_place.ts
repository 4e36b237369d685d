/** Place of a session's replay: the address of its page, that of its socket, and times along it. */

/** Path of the page that replays a session. */
export function replayAddress(session: string): string {
  return `/?replay=${encodeURIComponent(session)}`;
}

/** The session that a page replays, from its query; null: none. */
export function replayedIn(query: string): string | null {
  return new URLSearchParams(query).get("replay");
}

/** Address of the socket of a page. */
export function socketAddress({ protocol, host }: { protocol: string; host: string }, replayed: string | null): string {
  const query = replayed === null ? "" : `?replay=${encodeURIComponent(replayed)}`;
  return `${protocol === "https:" ? "wss" : "ws"}://${host}/ws${query}`;
}

/** "1:05", from s; "1:01:05" from an hour on. */
export function clockTime(seconds: number): string {
  const whole = Math.floor(seconds);
  const two = (number: number): string => String(number).padStart(2, "0");
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}
