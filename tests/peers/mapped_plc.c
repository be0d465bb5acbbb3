/* SPDX-License-Identifier: 0BSD
 *
 * Plays the PLC of examples/plc-maps/commit-bit.toml, one client at a time.
 *
 *     mapped_plc tcp              on a free port of 127.0.0.1, printed as "port N"
 *     mapped_plc rtu /dev/pts/3   as unit 1 of a serial line, "ready" printed
 *
 * Each time that it takes offsets over it prints "in force" and the eight numbers. A length
 * beyond 50 mm is refused with error 7.
 */

#include <arpa/inet.h>
#include <math.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { COILS = 2001, DISCRETES = 9, HOLDINGS = 118, INPUTS = 38 };
enum { TRIGGER = 2000 };
enum { DONE = 0, BUSY = 1, FAILED = 2, PERMIT = 3 };
enum { ERROR_CODE = 10, SELECTED = 11, PROBE = 20 };
enum { OUTSIDE_THE_LIMITS = 7, LARGEST_MM = 50 };
enum { NEEDLES = 2, COMPONENTS = 4 };

typedef enum { IDLE, WORKING, ANSWERED } step_t;

static const int needle_at[NEEDLES] = {100, 110};
static const float first_offsets[NEEDLES][COMPONENTS] = {
    {12.0f, -3.5f, -20.0f, 15.0f},
    {-12.0f, -3.5f, -21.0f, 0.0f},
};

/* The low word stands first here. The functions that name an order mean another one in
 * libmodbus 3.1.6 than in later versions. */
static float component(const modbus_mapping_t *tables, int needle, int n)
{
    return modbus_get_float(&tables->tab_registers[needle_at[needle] + 2 * n]);
}

static int within_limits(const modbus_mapping_t *tables)
{
    int needle, n;

    for (needle = 0; needle < NEEDLES; needle++)
        for (n = 0; n < COMPONENTS - 1; n++)
            if (fabsf(component(tables, needle, n)) > LARGEST_MM)
                return 0;
    return 1;
}

static void take_over(modbus_mapping_t *tables)
{
    int needle, n;

    if (!within_limits(tables)) {
        tables->tab_input_registers[ERROR_CODE] = OUTSIDE_THE_LIMITS;
        tables->tab_input_bits[FAILED] = 1;
        return;
    }
    printf("in force");
    for (needle = 0; needle < NEEDLES; needle++)
        for (n = 0; n < COMPONENTS; n++)
            printf(" %g", component(tables, needle, n));
    printf("\n");
    tables->tab_input_bits[DONE] = 1;
}

/* One cycle of the program. It answers a cycle after it was asked, so that busy is seen. */
static step_t cycle(modbus_mapping_t *tables, step_t step)
{
    if (!tables->tab_bits[TRIGGER]) {
        tables->tab_input_bits[BUSY] = 0;
        tables->tab_input_bits[DONE] = 0;
        tables->tab_input_bits[FAILED] = 0;
        tables->tab_input_registers[ERROR_CODE] = 0;
        return IDLE;
    }
    if (step == IDLE) {
        tables->tab_input_bits[BUSY] = 1;
        return WORKING;
    }
    if (step == WORKING) {
        tables->tab_input_bits[BUSY] = 0;
        take_over(tables);
    }
    return ANSWERED;
}

static modbus_mapping_t *switched_on(void)
{
    modbus_mapping_t *tables = modbus_mapping_new(COILS, DISCRETES, HOLDINGS, INPUTS);
    int needle, n;

    if (tables == NULL)
        return NULL;
    for (needle = 0; needle < NEEDLES; needle++)
        for (n = 0; n < COMPONENTS; n++)
            modbus_set_float(first_offsets[needle][n],
                             &tables->tab_registers[needle_at[needle] + 2 * n]);
    modbus_set_float(12.3456f, &tables->tab_input_registers[PROBE]);
    tables->tab_input_registers[SELECTED] = 1;
    tables->tab_input_bits[PERMIT] = 1;
    return tables;
}

/* Serves one client to its end; on a serial line there is only one. */
static void serve(modbus_t *link, modbus_mapping_t *tables, step_t *step, int serial)
{
    uint8_t request[MODBUS_MAX_ADU_LENGTH];
    int length;

    while ((length = modbus_receive(link, request)) >= 0 || serial)
        if (length > 0) {
            modbus_reply(link, request, length, tables);
            *step = cycle(tables, *step);
        }
}

static int serve_tcp(modbus_mapping_t *tables)
{
    modbus_t *link = modbus_new_tcp("127.0.0.1", 0);
    struct sockaddr_in address;
    socklen_t size = sizeof address;
    step_t step = IDLE;
    int listener;

    if (link == NULL || (listener = modbus_tcp_listen(link, 1)) < 0)
        return 1;
    if (getsockname(listener, (struct sockaddr *)&address, &size) < 0)
        return 1;
    printf("port %d\n", ntohs(address.sin_port));
    while (modbus_tcp_accept(link, &listener) >= 0) {
        serve(link, tables, &step, 0);
        modbus_close(link);
    }
    return 1;
}

static int serve_rtu(modbus_mapping_t *tables, const char *device)
{
    modbus_t *link = modbus_new_rtu(device, 115200, 'N', 8, 1);
    step_t step = IDLE;

    if (link == NULL || modbus_set_slave(link, 1) < 0 || modbus_connect(link) < 0)
        return 1;
    printf("ready\n");
    serve(link, tables, &step, 1);
    return 1;
}

int main(int argc, char **argv)
{
    modbus_mapping_t *tables = switched_on();

    setvbuf(stdout, NULL, _IOLBF, 0);
    if (tables == NULL)
        return 1;
    if (argc == 2 && strcmp(argv[1], "tcp") == 0)
        return serve_tcp(tables);
    if (argc == 3 && strcmp(argv[1], "rtu") == 0)
        return serve_rtu(tables, argv[2]);
    fprintf(stderr, "usage: %s tcp | rtu DEVICE\n", argv[0]);
    return 2;
}
