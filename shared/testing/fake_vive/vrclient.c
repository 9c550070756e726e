/* The client library of a SteamVR that is not there: what the openvr wheel loads and asks.
 *
 * State comes from `state.bin` beside this library, mapped into memory and written by runtime.py;
 * both sides name its fields in the same order. Everything is written between two increments of
 * `sequence`; it is odd while somebody writes. Only what a program that follows trackers asks
 * for is there: the other functions of the table count the call and answer 0.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { DEVICES = 8, TEXT = 32, SLOTS = 47 };
enum { NOT_INSTALLED_HERE = 102, NO_INTERFACE = 105, NOT_INITIALIZED = 109 };
enum { SERIAL = 1002, MODEL = 1001, BATTERY = 1012, CHARGING = 1011 };
enum { TOO_SMALL = 3, UNKNOWN_PROPERTY = 4, INVALID_DEVICE = 5 };
enum { QUIT = 700 };

struct pose { /* TrackedDevicePose_t */
  float matrix[12], velocity[3], spin[3];
  int32_t result;
  uint8_t is_valid, is_connected;
};

struct device {
  int32_t kind; /* 0 none, 1 headset, 3 tracker, 4 base station */
  int32_t is_connected, is_valid, result;
  float battery; /* 0 to 1 */
  int32_t is_charging;
  char serial[TEXT], model[TEXT];
  float matrix[12], velocity[3], spin[3];
};

struct state {
  volatile uint32_t sequence;
  int32_t init_error;   /* of the next initialisation */
  int32_t is_old;       /* knows no IVRSystem of this version */
  volatile int32_t quits; /* quit events still to be delivered */
  struct device devices[DEVICES];
  volatile uint32_t asked; /* calls for poses */
  volatile int32_t universe; /* of the last one */
  volatile uint32_t initialised, cleaned, acknowledged, unexpected;
};

static struct state *state;
static int is_up;

static void open_state(void) {
  Dl_info info;
  char path[PATH_MAX];
  if (state || !dladdr((void *)open_state, &info)) return;
  snprintf(path, sizeof path, "%s", info.dli_fname);
  char *end = strrchr(path, '/');
  if (!end || (size_t)(end - path) + sizeof "/state.bin" > sizeof path) return;
  strcpy(end, "/state.bin");
  int file = open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void *mapped = mmap(0, sizeof *state, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (mapped != MAP_FAILED) state = mapped;
}

static struct device device_at(uint32_t index) {
  struct device copy;
  memset(&copy, 0, sizeof copy);
  if (!state || index >= DEVICES) return copy;
  for (;;) {
    uint32_t before = state->sequence;
    __sync_synchronize();
    memcpy(&copy, &state->devices[index], sizeof copy);
    __sync_synchronize();
    if (!(before & 1) && before == state->sequence) return copy;
  }
}

/* IVRSystem, by its place in the table */

static void get_poses(int32_t universe, float ahead, struct pose *poses, uint32_t count) {
  (void)ahead;
  for (uint32_t index = 0; index < count; index++) {
    struct device device = device_at(index);
    struct pose *pose = &poses[index];
    memset(pose, 0, sizeof *pose);
    memcpy(pose->matrix, device.matrix, sizeof pose->matrix);
    memcpy(pose->velocity, device.velocity, sizeof pose->velocity);
    memcpy(pose->spin, device.spin, sizeof pose->spin);
    pose->result = device.kind ? device.result : 1;
    pose->is_valid = device.is_valid != 0;
    pose->is_connected = device.is_connected != 0;
  }
  state->universe = universe;
  state->asked++;
}

static int32_t get_class(uint32_t index) { return device_at(index).kind; }

static uint8_t is_connected(uint32_t index) { return device_at(index).is_connected != 0; }

static uint8_t get_bool(uint32_t index, int32_t property, int32_t *error) {
  struct device device = device_at(index);
  *error = !device.kind ? INVALID_DEVICE : property == CHARGING ? 0 : UNKNOWN_PROPERTY;
  return *error ? 0 : device.is_charging != 0;
}

static float get_float(uint32_t index, int32_t property, int32_t *error) {
  struct device device = device_at(index);
  *error = !device.kind ? INVALID_DEVICE : property == BATTERY ? 0 : UNKNOWN_PROPERTY;
  return *error ? 0.0f : device.battery;
}

static uint32_t get_string(
    uint32_t index, int32_t property, char *out, uint32_t size, int32_t *error) {
  struct device device = device_at(index);
  const char *text = property == SERIAL ? device.serial : device.model;
  *error = !device.kind ? INVALID_DEVICE
           : property != SERIAL && property != MODEL ? UNKNOWN_PROPERTY : 0;
  if (*error) return 0;
  uint32_t needed = (uint32_t)strnlen(text, TEXT - 1) + 1;
  if (size < needed) {
    *error = TOO_SMALL;
    return needed;
  }
  memcpy(out, text, needed - 1);
  out[needed - 1] = 0;
  return needed;
}

static uint8_t next_event(void *event, uint32_t size) {
  if (state->quits <= 0) return 0;
  state->quits--;
  memset(event, 0, size);
  *(uint32_t *)event = QUIT;
  return 1;
}

static void acknowledge_quit(void) { state->acknowledged++; }

static const char *runtime_version(void) { return "0.0.0 (a double)"; }

static uintptr_t unexpected(void) {
  state->unexpected++;
  return 0;
}

static void *table[SLOTS];

static void fill_table(void) {
  for (int slot = 0; slot < SLOTS; slot++) table[slot] = (void *)unexpected;
  table[11] = (void *)get_poses;
  table[19] = (void *)get_class;
  table[20] = (void *)is_connected;
  table[21] = (void *)get_bool;
  table[22] = (void *)get_float;
  table[27] = (void *)get_string;
  table[29] = (void *)next_event;
  table[44] = (void *)acknowledge_quit;
  table[46] = (void *)runtime_version;
}

/* IVRClientCore_003 */

static int32_t core_init(void *self, int32_t kind, const char *info) {
  (void)self, (void)kind, (void)info;
  open_state();
  if (!state) return NOT_INSTALLED_HERE;
  if (state->init_error) return state->init_error;
  fill_table();
  is_up = 1;
  state->initialised++;
  return 0;
}

static void core_cleanup(void *self) {
  (void)self;
  if (is_up) state->cleaned++;
  is_up = 0;
}

static int is_known(const char *version) {
  if (state && state->is_old) return 0;
  return !strcmp(version, "IVRSystem_023") || !strcmp(version, "FnTable:IVRSystem_023");
}

static int32_t core_is_valid(void *self, const char *version) {
  (void)self;
  open_state();
  return is_known(version) ? 0 : NO_INTERFACE;
}

static void *core_interface(void *self, const char *version, int32_t *error) {
  (void)self;
  *error = !is_up ? NOT_INITIALIZED : is_known(version) ? 0 : NO_INTERFACE;
  return *error ? 0 : table;
}

static uint8_t core_has_headset(void *self) {
  (void)self;
  return 0;
}

static const char *core_text(void *self, int32_t error) {
  (void)self, (void)error;
  return "a double knows no words";
}

static void *const methods[] = {
    (void *)core_init,      (void *)core_cleanup,     (void *)core_is_valid,
    (void *)core_interface, (void *)core_has_headset, (void *)core_text,
    (void *)core_text,
};
static const void *const *const core = (const void *const *)methods;

__attribute__((visibility("default"))) void *VRClientCoreFactory(const char *name, int *code) {
  int known = !strcmp(name, "IVRClientCore_003");
  if (code) *code = known ? 0 : NO_INTERFACE;
  return known ? (void *)&core : 0;
}
