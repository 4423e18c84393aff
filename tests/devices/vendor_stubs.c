/* Stand-ins for the vendors' libraries: enough of DHD and HD to drive the drivers, with hooks for the tests. */
#include <pthread.h>
#include <string.h>
#include <unistd.h>

volatile double stub_position[3], stub_velocity[3], stub_force[3];
volatile int stub_plugged = 1, stub_calibrated = 1, stub_buttons, stub_error, stub_opens;
volatile double stub_most_n = -1;
volatile int stub_gravity, stub_ramping;
volatile int stub_force_on, stub_watchdog, stub_stalled;

#ifdef STUB_DHD
int dhdOpen(void) { if (!stub_plugged) return -1; stub_opens++; return 0; }
int dhdClose(signed char id) { (void)id; return 0; }
const char *dhdGetSystemName(signed char id) { (void)id; return STUB_NAME; }
const char *dhdErrorGetLastStr(void) { return stub_plugged ? "no error" : "no device found"; }
static int gone(void) { while (stub_stalled) usleep(500); return stub_plugged ? 0 : -1; }
int dhdEnableForce(unsigned char on, signed char id) { (void)id; stub_force_on = on; return gone(); }
int dhdSetWatchdog(unsigned char ticks, signed char id) { (void)id; stub_watchdog = ticks; return gone(); }
int dhdGetPosition(double *x, double *y, double *z, signed char id) {
    (void)id; *x = stub_position[0]; *y = stub_position[1]; *z = stub_position[2]; return gone();
}
int dhdGetLinearVelocity(double *x, double *y, double *z, signed char id) {
    (void)id; *x = stub_velocity[0]; *y = stub_velocity[1]; *z = stub_velocity[2]; return gone();
}
int dhdSetForce(double x, double y, double z, signed char id) {
    (void)id; if (!stub_plugged) return -1;
    stub_force[0] = x; stub_force[1] = y; stub_force[2] = z; return 0;
}
#ifndef STUB_OLD
double dhdGetMaxForce(signed char id) { (void)id; return stub_most_n; }
int dhdSetGravityCompensation(int on, signed char id) { (void)id; stub_gravity = on; return 0; }
#endif
unsigned dhdGetButtonMask(signed char id) { (void)id; return stub_buttons; }
int dhdGetStatus(int *status, signed char id) {
    (void)id; memset(status, 0, 16 * sizeof(int)); status[0] = 1; status[3] = stub_calibrated; return gone();
}
#else
typedef struct { unsigned code; int internal; unsigned handle; } HDErrorInfo;
typedef unsigned (*callback_t)(void *);
static callback_t scheduled; static pthread_t thread; static volatile int running;
unsigned hdInitDevice(const char *name) {
    (void)name; if (!stub_plugged) { stub_error = 0x0302; return 0xFFFFFFFFu; } stub_error = 0; stub_opens++; return 7;
}
void hdDisableDevice(unsigned h) { (void)h; }
void hdEnable(unsigned what) { if (what == 0x4000) stub_force_on = 1; }
void hdDisable(unsigned what) { if (what == 0x4000) stub_force_on = 0; if (what == 0x4002) stub_ramping = 0; }
#ifndef STUB_OLD
unsigned char hdIsEnabled(unsigned what) { return what == 0x4002 ? stub_ramping : 0; }
#endif
static void *loop(void *_) {
    (void)_; while (running) { if (scheduled && !stub_stalled) scheduled(0); usleep(1000); } return 0;
}
void hdStartScheduler(void) { running = 1; pthread_create(&thread, 0, loop, 0); }
void hdStopScheduler(void) { if (running) { running = 0; pthread_join(thread, 0); } }
unsigned long hdScheduleAsynchronous(callback_t f, void *data, unsigned short priority) {
    (void)data; (void)priority; scheduled = f; return 1;
}
void hdUnschedule(unsigned long h) { (void)h; scheduled = 0; }
void hdBeginFrame(unsigned h) { (void)h; }
void hdEndFrame(unsigned h) { (void)h; if (!stub_plugged) stub_error = 0x0302; }
void hdGetDoublev(unsigned what, double *v) {
    if (what == 0x2050) memcpy(v, (void *)stub_position, 24);
    else if (what == 0x2051) memcpy(v, (void *)stub_velocity, 24);
    else if (what == 0x2603) v[0] = stub_most_n;
    else if (what == 0x2052) { memset(v, 0, 128); v[0] = v[5] = v[10] = v[15] = 1; }
}
void hdGetIntegerv(unsigned what, int *v) { if (what == 0x2000) *v = stub_buttons; }
void hdSetDoublev(unsigned what, const double *v) { if (what == 0x2700) memcpy((void *)stub_force, v, 24); }
unsigned hdCheckCalibration(void) { return stub_calibrated ? 0x5000 : 0x5001; }
HDErrorInfo hdGetError(void) { HDErrorInfo e = {stub_error, 0, 7}; if (stub_plugged) stub_error = 0; return e; }
#endif
