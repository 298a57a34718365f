/** The JSON payloads of the live view (docs/file_formats.md, Live view). Members that may be absent are optional. */

export interface Hello {
  protocol: number;
  session: string;
  program: string;
  source: { verb: string; name: string };
  can: { pilot: boolean; replay: boolean; exports: string[] };
  limits: { in_bytes: number; in_per_s: number };
}

export type WordLevel = "ok" | "warning" | "bad";
/** What is wrong now, for a person who scans. */
export interface Word { level: WordLevel; text: string; number?: string | number | null }

export interface Replay { time_s: number; begin_s: number; end_s: number; speed: number; paused: boolean }

export interface Vehicle {
  state: string;
  phase?: string;
  armed?: boolean;
  battery?: number | null;  // share, 0 to 1
  height_m?: number | null;
  floor_m?: number | null;
  speed_m_s?: number | null;
  velocity_m_s?: [number, number, number] | null;
  links?: Record<string, number | null>;
  fail_safes?: string[];
  pilot?: string | null;
}

export interface Telemetry {
  state?: "running" | "paused" | "finished" | "failed";
  reason?: string;  // why it failed
  progress?: { done: number; total: number; stage?: string };
  words?: Word[];
  coverage?: { area_m2?: number | null; share?: number | null };
  verdict?: { verdict: string; reasons?: string[] };
  replay?: Replay;
  vehicle?: Vehicle;
}

export type EventLevel = "info" | "warning" | "error";
export interface LiveEvent { id: number; time_s: number | null; level: EventLevel; text: string }

export type Numbers = Record<string, number | null>;
export interface Statistics {
  time_s?: number | null;
  stages?: Numbers;
  rates?: Numbers;
  counts?: Numbers;
  memory?: Numbers;
  parameters?: string;
}
