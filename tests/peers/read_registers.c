/* SPDX-License-Identifier: 0BSD
 *
 * Prints input registers of a Modbus server, one block a line, as hexadecimal words.
 *
 *     read_registers tcp 127.0.0.1 5020 0 112 112 36
 *     read_registers rtu /dev/pts/3 1 0 112
 *
 * After the way there (on a serial line: device and unit) come first register and count of
 * each block; one request reads one block.
 */

#include <errno.h>
#include <modbus/modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static modbus_t *opened(const char *way, const char *place, const char *number)
{
    modbus_t *link;

    if (strcmp(way, "tcp") == 0)
        return modbus_new_tcp(place, atoi(number));
    link = modbus_new_rtu(place, 115200, 'N', 8, 1);
    if (link != NULL)
        modbus_set_slave(link, atoi(number));
    return link;
}

static int printed(modbus_t *link, int first, int count)
{
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    int n;

    if (modbus_read_input_registers(link, first, count, words) != count)
        return 0;
    for (n = 0; n < count; n++)
        printf("%04x%c", words[n], n + 1 < count ? ' ' : '\n');
    return 1;
}

int main(int argc, char **argv)
{
    modbus_t *link;
    int n, well;

    if (argc < 6 || argc % 2 != 0) {
        fprintf(stderr, "usage: %s tcp|rtu PLACE NUMBER FIRST COUNT ...\n", argv[0]);
        return 2;
    }
    link = opened(argv[1], argv[2], argv[3]);
    well = link != NULL && modbus_connect(link) == 0;
    for (n = 4; well && n < argc; n += 2)
        well = printed(link, atoi(argv[n]), atoi(argv[n + 1]));
    if (!well)
        fprintf(stderr, "%s\n", modbus_strerror(errno));
    modbus_close(link);
    modbus_free(link);
    return well ? 0 : 1;
}
