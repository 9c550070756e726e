// The tones of the score: 440 Hz while the antagonist scores, 300 Hz on a penalty, silence otherwise.

const TONES = [440, 300]; // Hz
const RAMP = 0.005; // s: no clicks
const LOUDNESS = 0.22;

export class Tones {
  constructor() {
    this.context = null;
    this.hz = 0;
    this.isMuted = false;
  }

  /** Begin; browsers allow it only after a click or a key. */
  start() {
    if (this.context) {
      if (this.context.state === "suspended") this.context.resume();
      return;
    }
    this.context = new AudioContext({ latencyHint: "interactive" });
    this.analyser = this.context.createAnalyser();
    this.analyser.fftSize = 8192;
    this.analyser.connect(this.context.destination);
    this.gains = TONES.map((hz) => {
      const oscillator = this.context.createOscillator();
      const gain = this.context.createGain();
      oscillator.frequency.value = hz;
      gain.gain.value = 0;
      oscillator.connect(gain).connect(this.analyser);
      oscillator.start();
      return gain.gain;
    });
    this.context.resume();
    this.ramp();
  }

  /** Sound at hz, 0 for silence. */
  set(hz) {
    if (hz === this.hz) return;
    this.hz = hz;
    this.ramp();
  }

  mute(isMuted) {
    this.isMuted = isMuted;
    this.ramp();
  }

  ramp() {
    if (!this.context) return;
    const now = this.context.currentTime;
    this.gains.forEach((gain, k) => {
      const loudness = TONES[k] === this.hz && !this.isMuted ? LOUDNESS : 0;
      gain.cancelScheduledValues(now);
      gain.setValueAtTime(gain.value, now);
      gain.linearRampToValueAtTime(loudness, now + RAMP);
    });
  }

  /** Return what is to be heard: loudness and frequency as measured at the output. */
  measure() {
    if (!this.context) return { state: "none", hz: 0, level: 0 };
    const wave = new Float32Array(this.analyser.fftSize);
    this.analyser.getFloatTimeDomainData(wave);
    const level = Math.sqrt(wave.reduce((sum, n) => sum + n * n, 0) / wave.length);
    const spectrum = new Float32Array(this.analyser.frequencyBinCount);
    this.analyser.getFloatFrequencyData(spectrum);
    const loudest = spectrum.indexOf(Math.max(...spectrum));
    const hz = level > 1e-3 ? (loudest * this.context.sampleRate) / this.analyser.fftSize : 0;
    return { state: this.context.state, hz, level, asked: this.hz };
  }
}
